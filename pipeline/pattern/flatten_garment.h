#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "pipeline/pattern/flatten_stage.h"
#include "registration/flattening/flatten_surface.h"
#include "registration/flattening/flatten_watcher.h"
#include "registration/outlines/outline_measures.h"

namespace atelier {

/// Everything that is made of one mesh.
struct FlattenedGarment {
  Mesh mesh;
  FlatPattern pattern;
  FlatMeasures measures;
  SewingPattern draft;  ///< the pattern as it is drawn, in the order and the words of the craft
  OutlineMeasures outlines;
  PatternLayout layout;
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();  ///< where its wearer looks; zero: not known
  bool reached = true;                               ///< what was asked of found seams
  double deviation_mean = 0, deviation_max = 0;      ///< m, off the smoothed surface
  bool relaxed = true;  ///< hangs as captured, where that was asked for
  bool equal = true;    ///< both sides of every seam are equally long, where that was asked for
};

/// Reads a garment's surface, finds its seams and lays it flat. Throws DataError for what cannot be
/// flattened, with the file.
FlattenedGarment flatten_garment(const FlattenGarment& garment, const FlattenStageOptions& options,
                                 const FlattenWatcher& watcher);

/// Its figures in a line, and for machines.
std::string summary_of(const FlattenedGarment& flat);
nlohmann::ordered_json json_of(const FlattenedGarment& flat);

/// The largest difference of a seam's two sides, on the surface's pattern and as it is drawn.
double mismatch_of(const FlattenedGarment& flat);

/// The mesh with its flat panels as texture coordinates, in metres.
Mesh with_flat_uvs(const FlattenedGarment& flat);

}  // namespace atelier
