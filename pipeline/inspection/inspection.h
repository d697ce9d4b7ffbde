#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/finding.h"
#include "core/io/safetensors.h"
#include "core/store/consent.h"
#include "core/store/stage.h"
#include "core/tensor.h"

namespace atelier {

/// Properties of a file, in order: numbers stay numbers, so that machines get them as such.
/// Findings are what is wrong with it.
struct Inspection {
  struct Fact {
    std::string name;  ///< lower_case words
    nlohmann::ordered_json value;
    std::string unit;  ///< "m2", "" for none
  };

  std::vector<Fact> facts;
  std::vector<Fact> members;  ///< what a container holds, by the names that the file gives
  std::vector<Finding> findings;
  std::span<const Stage> stages;  ///< the program's, which know the units of their metrics

  void add(const std::string& name, nlohmann::ordered_json value, const std::string& unit = "") {
    facts.push_back({name, std::move(value), unit});
  }
  void add_member(const std::string& name, nlohmann::ordered_json value,
                  const std::string& unit = "") {
    members.push_back({name, std::move(value), unit});
  }
};

/// Inspects a file or a folder. Throws DataError for what its reader refuses, what no reader takes,
/// and kinds that are known and not opened; EnvironmentError for what cannot be read.
Inspection inspect_path(const std::filesystem::path& path, std::span<const Stage> stages = {});

/// Adds an array as a member: type, shape and, of numbers, the range; a finding where some are not
/// finite, with the place of the first.
void add_array(const std::string& name, const Tensor& tensor, Inspection& inspection);

/// Adds what was agreed to; a warning for each consent whose last day is over.
void add_stated_consent(const std::vector<Consent>& consent, const std::filesystem::path& place,
                        Inspection& inspection);

/// {"file": ..., "area": 1.5, "units": {"area": "m2"}, "members": {...}, "findings": [...]}
nlohmann::ordered_json json_of(const Inspection& inspection);

/// A line for each fact, member and finding, without control characters.
std::string text_of(const Inspection& inspection);

// One for each kind of file. They add what they find, and throw as the readers that they call.
void inspect_mesh(const std::filesystem::path& path, Inspection& inspection);
void inspect_scene(const std::filesystem::path& path, Inspection& inspection);
void inspect_image(const std::filesystem::path& path, Inspection& inspection);
void inspect_npy(const std::filesystem::path& path, Inspection& inspection);
void inspect_npz(const std::filesystem::path& path, Inspection& inspection);
void inspect_safetensors(const std::filesystem::path& path, Inspection& inspection);
void inspect_hdf5(const std::filesystem::path& path, Inspection& inspection);
/// An archive of whatever schema, its bytes compared with their digest; of a schema that is known
/// in a version that is known. Throws as read_archive.
Archive read_any_archive(const std::filesystem::path& path);
/// Throws what reading an archive of this schema, or a network, throws; a note where no reader
/// takes the schema by itself.
void judge_archive(const Archive& archive, const std::filesystem::path& path,
                   Inspection& inspection);
void judge_network(const Safetensors& content, const std::filesystem::path& path);
void inspect_json(const std::filesystem::path& path, Inspection& inspection);
void inspect_toml(const std::filesystem::path& path, Inspection& inspection);
void inspect_zip(const std::filesystem::path& path, Inspection& inspection);
void inspect_svg(const std::filesystem::path& path, Inspection& inspection);
void inspect_dxf(const std::filesystem::path& path, Inspection& inspection);
/// Text or binary by its first bytes.
void inspect_usd(const std::filesystem::path& path, Inspection& inspection);
void inspect_usda(const std::filesystem::path& path, Inspection& inspection);
/// Binary USD, alone or in a package: its meshes as one.
void inspect_usd_mesh(const std::filesystem::path& path, Inspection& inspection);
void inspect_page(const std::filesystem::path& path, Inspection& inspection);        // HTML
void inspect_table(const std::filesystem::path& path, Inspection& inspection);       // CSV
void inspect_json_lines(const std::filesystem::path& path, Inspection& inspection);  // JSON Lines
void inspect_folder(const std::filesystem::path& path, Inspection& inspection);
// With capture_layouts.
void inspect_video(const std::filesystem::path& path, Inspection& inspection);
void inspect_yaml(const std::filesystem::path& path, Inspection& inspection);  // OpenCV's
void inspect_colmap_text(const std::filesystem::path& path, Inspection& inspection);
void inspect_colmap_binary(const std::filesystem::path& path, Inspection& inspection);
/// Whether a folder is a capture: images alone may be the textures of meshes.
enum class Evidence { Any, MoreThanPictures };
/// A capture in the layout of another program; false, and nothing added, where it is none.
bool inspect_capture_folder(const std::filesystem::path& path, Inspection& inspection,
                            Evidence evidence = Evidence::Any);
void inspect_target(const std::filesystem::path& path, Inspection& inspection);  // with bodymodel
void inspect_measurements(const std::filesystem::path& path, Inspection& inspection);
void inspect_mhclo(const std::filesystem::path& path, Inspection& inspection);    // with bodymodel
void inspect_motion(const std::filesystem::path& path, Inspection& inspection);   // with bodymodel
void inspect_markers(const std::filesystem::path& path, Inspection& inspection);  // with bodymodel
/// Properties of a body or motion of ours or of the SMPL family beside its arrays; nothing for
/// another npz.
void inspect_person(const std::filesystem::path& path, Inspection& inspection);  // with bodymodel

}  // namespace atelier
