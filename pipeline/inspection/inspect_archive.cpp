// Errors in an archive's schema that every stage that reads it would refuse.

#include <algorithm>

#include "appearance/appearance_colors.h"
#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/painted_picture.h"
#include "appearance/painted_scene.h"
#include "appearance/training.h"
#include "bodymodel/formats/tracked_motion.h"
#include "core/archive.h"
#include "core/file_kind.h"
#include "core/garment_archive.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/mesh_sequence_file.h"
#include "core/sequence_archive.h"
#include "pipeline/inspection/inspection.h"
#include "pipeline/synthesis/performance_state.h"
#include "simulation/animated_frame.h"
#include "simulation/cloth_state_archive.h"
#include "simulation/simulation_table.h"

namespace atelier {
namespace {

/// Its first dimensions, of as many as asked for; 0 where there is no such array, which its reader
/// then says. What a frame or an image is held against stands elsewhere: here in itself.
std::int64_t extent(const Archive& archive, const char* name, std::size_t dimension = 0) {
  const auto found = archive.datasets.find(name);
  const bool there = found != archive.datasets.end() && dimension < found->second.shape.size();
  return there ? found->second.shape[dimension] : 0;
}

struct ArchiveSchema {
  const char* name;
  int newest_version;
  void (*read)(const Archive& archive, const std::string& file);
};

const ArchiveSchema kArchiveSchemas[] = {
    {"atelier.mesh", 1,
     [](const Archive& archive, const std::string& file) { mesh_of(archive, file); }},
    {"atelier.sequence", 1,
     [](const Archive& archive, const std::string& file) { sequence_header_of(archive, file); }},
    {"atelier.garment", 1,
     [](const Archive& archive, const std::string& file) { garment_of(archive, file); }},
    {"atelier.tracked", 1,
     [](const Archive& archive, const std::string& file) { tracked_motion_of(archive, file); }},
    {"atelier.truth", 1,
     [](const Archive& archive, const std::string& file) { truth_of(archive, file); }},
    {"atelier.mesh_sequence", 1,
     [](const Archive& archive, const std::string& file) {
       mesh_sequence_of(archive.datasets, file);
     }},
    {"atelier.appearance_data", 2,
     [](const Archive& archive, const std::string& file) {
       check_appearance_data(appearance_data_of(archive, file), file);
     }},
    {"atelier.appearance_colors", 1,
     [](const Archive& archive, const std::string& file) {
       appearance_colors_of(archive, extent(archive, "drawn"), file);
     }},
    {"atelier.painted_scene", 1,
     [](const Archive& archive, const std::string& file) { painted_scene_of(archive, file); }},
    {"atelier.painted_picture", 1,
     [](const Archive& archive, const std::string& file) {
       painted_picture_of(archive, static_cast<int>(extent(archive, "colors", 1)),
                          static_cast<int>(extent(archive, "colors")), file);
     }},
    {"atelier.cloth_state", 1,
     [](const Archive& archive, const std::string& file) {
       cloth_state_of(archive, extent(archive, "positions"), file);
     }},
    {"atelier.simulated_frame", 1,
     [](const Archive& archive, const std::string& file) {
       simulated_frame_of(archive, extent(archive, "positions"), file);
     }},
    {"atelier.animated_frame", 1,
     [](const Archive& archive, const std::string& file) {
       animated_frame_of(archive, extent(archive, "positions"), file);
     }},
    {"atelier.synthesis.state", 1,
     [](const Archive& archive, const std::string& file) {
       performance_state_of(archive, extent(archive, "cloth/positions"),
                            extent(archive, "flesh/offset"), file);
     }},
};

/// Null where this program has no reader of it by itself.
const ArchiveSchema* schema_named(const std::string& name) {
  const auto found = std::find_if(std::begin(kArchiveSchemas), std::end(kArchiveSchemas),
                                  [&](const ArchiveSchema& one) { return name == one.name; });
  return found == std::end(kArchiveSchemas) ? nullptr : found;
}

/// @return  false where it cannot be judged
bool judge(const Archive& archive, const std::filesystem::path& path) {
  if (archive.schema == "atelier.truth.frame") {  // truth/frames/000012.h5 of truth/truth.h5
    const std::filesystem::path whole = path.parent_path() / ".." / "truth.h5";
    if (file_kind(whole) != std::filesystem::file_type::regular) {
      return false;
    }
    ground_truth_frame_of(
        archive, truth_of(read_archive(whole, "atelier.truth", 1), whole.string()), path.string());
    return true;
  }
  const ArchiveSchema* schema = schema_named(archive.schema);
  if (schema != nullptr) {
    schema->read(archive, path.string());
  }
  return schema != nullptr;
}

}  // namespace

Archive read_any_archive(const std::filesystem::path& path) {
  const Archive head = archive_contents(path);
  const ArchiveSchema* schema = schema_named(head.schema);
  return read_archive(path, head.schema, schema == nullptr ? head.version : schema->newest_version);
}

void judge_archive(const Archive& archive, const std::filesystem::path& path,
                   Inspection& inspection) {
  if (!judge(archive, path)) {
    inspection.findings.push_back({Severity::Note, "schema-not-judged", path.string(),
                                   "what schema '" + archive.schema + "' asks for was not compared",
                                   archive.schema == "atelier.truth.frame"
                                       ? "it is read with the truth.h5 of its capture"
                                       : "no reader of this program takes it by itself"});
  }
}

void judge_network(const Safetensors& content, const std::filesystem::path& path) {
  const auto says = [&](const char* key, std::string_view value) {
    const auto found = content.metadata.find(key);
    return found != content.metadata.end() && found->second.starts_with(value);
  };
  if (says("training", "atelier.")) {
    training_of(content.tensors, content.metadata, path.string());
  } else if (says("schema", "atelier.appearance")) {
    appearance_model_of(content.tensors, content.metadata, path.string());
  }
}

}  // namespace atelier
