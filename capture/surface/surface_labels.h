#pragma once

#include <cstdint>
#include <vector>

#include "capture/stereo/stereo.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

/// One camera's labels.
struct LabelView {
  Camera camera;                    ///< as its images are, distortion included
  ByteImage labels;                 ///< [H,W] numbers of the taxonomy; 255: says nothing
  const DepthMap* depth = nullptr;  ///< what its stereo found, of the labels' size, or null: as
                                    ///< sure as any view can be
};

struct SurfaceLabelOptions {
  double border = 3;            ///< px: a pixel so near another label counts less
  double max_view_angle = 1.3;  ///< rad between normal and view beyond which a view is not asked
  double smoothness = 1;        ///< cost of a border between neighbours against a vote; 0: none
  int rounds = 3;               ///< in which views that disagree with the others lose weight
};
OptionTable describe(SurfaceLabelOptions& options);

/// Votes of the views that see each vertex, as probabilities [V, labels], labels in the order of
/// `ids`; a vertex that nobody sees has a row of equal ones.
struct LabelVotes {
  std::vector<std::uint8_t> ids;  ///< labels that occur, increasing, without Background
  Eigen::MatrixXd probability;    ///< [V, ids]
  std::vector<double> trust;      ///< [views] 0 to 1: how well each agrees with the others
};

/// Each vertex asks the views that see it (not hidden by the mesh itself), weighted by the squared
/// cosine of the view, by how sure the view's own depth is that the surface is there (a quarter
/// where it knows none or another one), and less near borders. Views that contradict the others
/// lose weight round by round, so that a whole wrong image is outvoted. Throws LogicError for sizes
/// that differ. Cost: V x views rays. Our choice of weights.
LabelVotes label_votes(const Mesh& mesh, const std::vector<LabelView>& views,
                       const SurfaceLabelOptions& options = {});

/// The labelling of least cost: votes against borders between neighbours, by alpha expansion
/// (Boykov 2001, CGAL's). Short borders cost less than long ones, whatever the mesh; the votes of a
/// vertex of confidence 0 (what the hull closes) count a quarter, since it may lie off the surface.
std::vector<std::uint8_t> smooth_labels(const Mesh& mesh, const LabelVotes& votes,
                                        const SurfaceLabelOptions& options = {});

}  // namespace atelier
