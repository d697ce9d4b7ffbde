#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/io/polygon_mesh.h"
#include "core/mesh.h"
#include "registration/flattening/flatten_watcher.h"

namespace atelier {

/// A garment's surface as it can be flattened.
struct FlattenSurface {
  Mesh mesh;                ///< oriented, without needless triangles and loose vertices
  std::vector<char> seams;  ///< [E] given ones, a flag for each edge; none for "auto" and "none"
};

/// Reads it: before the long work, which changes no edge of a mesh whose seams are given. Says what
/// was turned or left out, warns `triangles-left-out`, `unit-unknown` and `size-unlikely`.
/// @param seams  as FlattenStageOptions has them
///
/// Throws DataError for a file that is no mesh, as check_flattenable and seam_input, for a mesh
/// without area or below 1 mm (the pattern's files hold micrometres), and for one with one side
/// alone, a Moebius strip.
FlattenSurface read_flatten_surface(const std::filesystem::path& file, const std::string& seams,
                                    const MeshConvention& convention,
                                    const FlattenWatcher& watcher);

/// A result of `template`: meshes in a folder, and beside that folder a file that describes them.
inline constexpr const char* kTemplateFile = "template.json";
inline constexpr const char* kTemplateGarments = "garments";

/// The description of a mesh by `template`.
struct TemplateNote {
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();  ///< where its wearer looks; zero: not known
  std::optional<int> frame;                          ///< in whose pose it is
  bool rest = false;  ///< without what folds took (registration/flattening/rest_surface.h): it
                      ///< hangs nowhere
};

/// A garment to be flattened.
struct FlattenGarment {
  std::filesystem::path file;
  TemplateNote note;
  std::filesystem::path captured = {};  ///< folder of it and its body as captured; empty: none
};

/// Where the note on a mesh would be: beside it, as in WORKSPACE/surfaces, else, of one in a folder
/// of the name, beside that folder, as in a result of `template`.
std::filesystem::path template_file(const std::filesystem::path& mesh);

/// The entry of a label in a template.json; an empty note where it is not there, says nothing of
/// it, or is another file of that name. Throws DataError where it cannot be read, or says of the
/// label what is no frame or no direction.
TemplateNote template_note(const std::filesystem::path& file, const std::string& label);

/// Whether a garment is such a surface: by its note, by one that its INPUT leaves unread, or by its
/// name (kRestFile). Throws as template_note.
bool is_rest(const FlattenGarment& garment);

}  // namespace atelier
