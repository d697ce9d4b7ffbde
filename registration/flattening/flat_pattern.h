#pragma once

#include <string>
#include <vector>

#include "core/garment.h"
#include "core/options.h"
#include "registration/flattening/flatten_panel.h"
#include "registration/flattening/surface_cut.h"

namespace atelier {

/// Two runs of the panels' edges that are sewn together. Vertices are of the flat panels, `b[i]` is
/// sewn to `a[i]`; `a` runs counter-clockwise round its panel, `b` clockwise. Of a dart both lie in
/// one panel and share their last vertex.
struct FlatSeam {
  std::string name;
  int panel_a = 0, panel_b = 0;
  std::vector<int> a, b;
};

/// A garment's surface in flat panels at true scale, each with its grain (warp) along +y, as seen
/// from outside. Panels lie one over another until they are packed.
struct FlatPattern {
  SurfaceCut cut;                        ///< whose vertices are those of the panels
  Points2 vertices;                      ///< [C,2] m
  std::vector<std::string> panel_names;  ///< [P]
  std::vector<FlatSeam> seams;
  std::vector<int> overlapping;    ///< panels that lie over themselves, see flat_overlaps.h
  std::vector<int> not_converged;  ///< panels that ran out of iterations
};

/// How a cut surface becomes flat panels.
struct FlattenOptions {
  FlattenPanelOptions panel;
  bool equal_seams = true;  ///< both sides of a seam get the same length
};
OptionTable describe(FlattenOptions& options);

/// Lays the panels of a cut surface flat (flatten_panel). With `equal_seams` both sides of a seam
/// are pulled to the mean of their lengths, in all and over 15 cm to either side of every place,
/// which takes three further rounds, and up to three more, held firmer, while some seam differs by
/// more than 0.2%. The grain is where the world's up lies on most of the panel; along its longest
/// direction where up is nowhere. Panels that no place of `start` turns over go on from there.
///
/// `cut` has one flag for each edge of the topology of `mesh.faces`; panels must be disks
/// (cut_to_disks makes them so). Throws DataError as flatten_panel does, naming the panel;
/// LogicError for another number of flags or places.
/// @param start  [C,2] m, of an earlier pattern of the same cut; or empty
FlatPattern flatten_surface(const Mesh& mesh, const std::vector<char>& cut,
                            const FlattenOptions& options = {}, const Points2& start = {});

/// Throws DataError unless the surface can be cut and laid flat: numbers that are not finite, no
/// face, faces without area, edges of three faces or more or of opposite orientation.
void check_flattenable(const Mesh& mesh, const std::string& file = "");

/// How far a flat pattern is from the surface it was taken from.
struct FlatMeasures {
  Eigen::MatrixX2d stretches;  ///< [F,2] principal stretches, curved over flat, the larger first
  Eigen::VectorXd strain;      ///< [F] the larger of |stretch - 1|
  double strain_p50 = 0, strain_p95 = 0, strain_p99 = 0, strain_max = 0;  ///< by area
  /// The larger of |stretch - 1| along the warp and along the weft of each face, by area: woven
  /// cloth gives on the bias.
  double thread_p99 = 0;
  double area_ratio = 1;     ///< flat over curved, of all
  double seam_mismatch = 0;  ///< largest |length a - length b| / their mean
  double seam_length = 0;    ///< m, of every seam once
  int inverted = 0;          ///< faces turned over
  int overlaps = 0;          ///< panels that lie over themselves
};
FlatMeasures measure_flat(const Mesh& mesh, const FlatPattern& pattern);

/// The surface as a garment whose rest shape is the flat pattern: for simulation, the mesh whole,
/// `rest` the panels side by side.
Garment garment_of(const Mesh& mesh, const FlatPattern& pattern);

}  // namespace atelier
