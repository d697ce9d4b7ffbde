#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "pipeline/pattern/flatten_stage.h"
#include "registration/drafting/drawing_measures.h"
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
  std::vector<std::string> panel_names;  ///< [P] of `pattern`, as the draft has them
  OutlineMeasures outlines;
  DrawingMeasures drawing;
  PatternLayout layout;
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();  ///< where its wearer looks; zero: not known
  bool reached = true;                               ///< what was asked of found seams
  double deviation_mean = 0, deviation_max = 0;      ///< m, off the smoothed surface
  bool relaxed = true;  ///< hangs as captured, where that was asked for
  bool equal = true;    ///< both sides of every seam are equally long, where that was asked for
  std::optional<SewnPattern> sewn;  ///< anew, of the written file, where its body is known
  bool sewable = true;              ///< it could be, where that was asked for
};

/// Refuses, before the work, a body on which these garments cannot be sewn anew: one that is not
/// there or has none of a garment's frame, bodies of a sequence for a garment of which nobody says
/// the frame, and a rest surface, which no body wore. UsageError for the check's other options
/// where no body is known. Throws DataError.
void require_sewable(const FlattenStageOptions& options,
                     const std::vector<FlattenGarment>& garments);

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
