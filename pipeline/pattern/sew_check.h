#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/options.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

inline constexpr const char* kNoSewCheck = "none";

/// How a written pattern is sewn anew and draped.
struct SewCheckOptions {
  /// Mesh of the body that the garment was captured on, or folder of a sequence of bodies, of which
  /// the one of its frame is taken; empty: that of the INPUT, if it has one; kNoSewCheck: no check.
  std::string body;
  std::string fabric;         ///< of the garment; empty: the default material
  double edge_length = 0.02;  ///< m, of the triangles, 0.005 to 0.1
  double seconds = 2;         ///< simulated, 0.05 to 60
};
OptionTable describe(SewCheckOptions& options);

/// A garment as it was captured, on its body in that frame.
struct WornGarment {
  Mesh cloth;  ///< of the faces of the surface that is flattened
  Mesh body;
  double acceleration = -1;  ///< m/s2: how its motion held it up; below 0: not known
};

/// The folder `captured/LABEL` beside a surface in `folder`, where a run says how that garment was
/// captured; empty: there is none.
std::filesystem::path worn_folder(const std::filesystem::path& folder,
                                  const std::filesystem::path& mesh);

/// Writes such a folder: garment.obj, body.obj and captured.json (frame, acceleration).
void write_worn(const std::filesystem::path& folder, const WornGarment& worn, int frame_id);
/// Throws DataError where it cannot be read.
WornGarment read_worn(const std::filesystem::path& folder);

/// What is sewn anew: the text of the file, and the surface that its panels were taken from.
struct WrittenPattern {
  const std::string& text;                ///< of pattern.json
  const std::vector<std::string>& names;  ///< [P] of the flat panels, as the file has them
  const FlatPattern& flat;
  const Mesh& mesh;     ///< that is cut in `flat`
  const Mesh& surface;  ///< as it was read, before anything was smoothed, in the pose of `mesh`
};

/// A pattern sewn anew and draped.
struct SewnPattern {
  Mesh mesh;      ///< the draped garment
  Mesh captured;  ///< what it is held against
  Mesh body;
  Eigen::Matrix3d turn;      ///< of the surface into the captured frame, as its wearer turned
  Eigen::VectorXd off;       ///< [V] m, of each of its vertices from the captured surface
  double mean = 0;           ///< m, distance of both surfaces from each other, by area
  double p95 = 0;            ///< m
  double acceleration = -1;  ///< as WornGarment has it
};

/// Reads the pattern, cuts its panels into triangles, lays them where they were worn, sews them
/// there and lets the garment hang on the body under gravity, with the flat panels as its rest
/// shape, at the captured garment's distance from the skin. A waist on the hips is held. Distances
/// are measured both ways, from each surface to the nearest point of the other, half of each. None
/// where `stopped`.
///
/// Throws DataError for a file that is no pattern of these panels, for a captured mesh of other
/// faces than the surface's, for seams that lie more than 10 cm apart, and as make_cloth and
/// Solver::step.
std::optional<SewnPattern> sew_anew(const WrittenPattern& written, const WornGarment& worn,
                                    const SewCheckOptions& options,
                                    const std::function<bool()>& stopped);

}  // namespace atelier
