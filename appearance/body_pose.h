#pragma once

#include <Eigen/Core>
#include <vector>

#include "appearance/surface_frame.h"
#include "core/types.h"

namespace atelier {

/// What tells how a body is bent from the vertices of its surface alone, so that whatever moves the
/// body can be drawn: nobody has to say which joint angles made the surface.
struct BodyParts {
  FloatRows rest;            ///< [V,3] m, the surface in rest pose
  std::vector<int> part;     ///< [V] of 0..J-1, the part that each vertex moves with most
  std::vector<int> parents;  ///< [J] the part that each hangs on, before it; itself: on none
  /// [3J] the least and the largest of each number of a code that was learnt from; empty: any.
  std::vector<float> low = {}, high = {};
};

/// Throws DataError unless the arrays have the same rows, every number is finite and names a part
/// that is there, parents come first, and low is not above high. @param file  for errors
void check_body_parts(const BodyParts& parts, const std::string& file = "");

/// The parts with points of the face, which hang on a part, the head, and have no vertices: what
/// they are off their mean places is told beside the pose.
BodyParts with_face(BodyParts parts, int head, int points);

/// How many points of the face there are among the parts: the last of them, without vertices.
int face_points(const BodyParts& parts);

/// The parts of a body with these joints. A joint that moves too few vertices to say how it is
/// turned is a part with its parent.
/// @param rest     [V,3] m
/// @param joints   [V] the joint that moves each vertex most
/// @param parents  [J] of the joints, before them; -1: none
BodyParts body_parts(const Points& rest, const std::vector<int>& joints,
                     const std::vector<int>& parents);

/// How each part is turned against the one that it hangs on, as rotation vectors, rad; 0 in rest
/// pose, and for a part that hangs on none. Of each part the turn is that of the rigid motion which
/// brings its rest vertices nearest to where they are (Kabsch 1976). Beyond what was learnt from a
/// number is the nearest that was: networks do not know how to go on. [3J]
/// @param position  [V,3] m
/// @param face      [3K] cm off their mean places, of the points of the face; empty: 0
std::vector<float> pose_code(const BodyParts& parts, const Eigen::Ref<const FloatRows>& position,
                             const std::vector<float>& face = {});

/// The parts with the range of the codes of these surfaces.
BodyParts with_range(BodyParts parts, const std::vector<SurfaceFrame>& frames);

/// Where a part's turn is felt, [V,J] in [0,1]: on itself and on the part that it hangs on, fading
/// over `rings` of neighbours. With it a hand that was never seen over a bent knee does not change
/// with the knee (Bagautdinov et al. 2021, section 4.2).
Eigen::MatrixXf pose_masks(const BodyParts& parts, const Triangles& faces, int rings = 3);

}  // namespace atelier
