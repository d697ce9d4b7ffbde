#pragma once

#include <vector>

#include "bodymodel/underlying/clothed_scan.h"
#include "core/options.h"

namespace atelier {

/// The surface of a person as it is seen, in one frame: the posed body, displaced to the scan where
/// that shows skin, and out to hair and shoes, which have volume. The displacement is smooth (the
/// Dirichlet energy of its difference from the body, from coarse to fine), so that details of the
/// body stay under it, and points keep to planes of the scan in both directions. Where a body looks
/// at hair or shoes, they are met along its normals; elsewhere nothing pulls but the neighbours.

struct OuterSurfaceOptions {
  int iterations = 10;             ///< of ICP: correspondences, then a solve, 1..100
  double coupling_length = 0.012;  ///< m, over which a displacement changes; 4 times that at first
  double anchor_weight = 0.005;    ///< of the body's own position, relative to data's 1
  double skin_reach = 0.03;        ///< m, maximum distance of correspondences of skin
  double cover_reach = 0.2;        ///< m, maximum distance of hair and shoes from the body
  double skin_scale = 0.01;        ///< m, scale of the robust loss of skin
};
OptionTable describe(OuterSurfaceOptions& options);

struct OuterSurface {
  Points vertices;          ///< [V,3] metres
  Eigen::VectorXd support;  ///< [V] in [0,1], how much the scan says of each
  Eigen::VectorXd cover;    ///< [V] in [0,1], share of that which is hair or shoes
  /// m, mean distance of the scan's points from the surface, by area; one out of reach counts as
  /// far as that. 0 where there are none.
  double skin_distance = 0;
  double cover_distance = 0;
  double skin_area = 0;   ///< m2, of the scan's skin
  double cover_area = 0;  ///< m2, of its hair and shoes
  Index turned = 0;       ///< faces that look away from where they did on the body
};

/// Fits one frame. ScanRole::Skin is skin and tight clothing, ScanRole::Cover is hair and shoes,
/// whatever else the scan has is to be Ignored. Throws LogicError for sizes that do not agree.
/// Results do not depend on the number of threads.
/// @param posed  [V,3] the body in the frame's pose, metres, closed with `faces`
OuterSurface outer_surface(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                           const OuterSurfaceOptions& options = {});

/// Vertices that are hair or shoe in one group of frames, and skin in the other: shoes of clothed
/// frames, which the minimally clothed person does not wear. [V] 1, grown by `rings` of neighbours,
/// and by what no frame says anything of beside them: the soles of these shoes. Throws LogicError
/// unless all have the same rows.
std::vector<char> differently_covered(const Triangles& faces,
                                      const std::vector<const OuterSurface*>& one,
                                      const std::vector<const OuterSurface*>& other, int rings = 2);

/// The mean displacement of several frames, [V,3] m in the axes of the surface
/// (surface_frames.h), each frame weighted by its support of the vertex; where no frame says
/// anything, the plain mean. Throws LogicError unless all have the same rows.
Points mean_displacement(const std::vector<Points>& displacements,
                         const std::vector<Eigen::VectorXd>& supports);

}  // namespace atelier
