#pragma once

#include "registration/tracking/garment_scan.h"

namespace atelier {

/// How much of a garment is inside the body, which no cloth is.
struct BodyContact {
  double inside = 0;  ///< share of its vertices and its triangles' centres
  double depth = 0;   ///< m, of the deepest of them
  int crossings = 0;  ///< pairs of one triangle of the cloth and one of the body that meet
};

/// Of cloth at x, [V,3] m; zeros without a body. Results of depths_inside and self_intersections,
/// and at their cost; throws LogicError as they do.
BodyContact body_contact(const Points& x, const Triangles& faces, const BodyObstacle& body);

/// Cloth at x, [V,3] m, moved no farther than it must to lie outside of the body, `gap` metres off
/// it, with no triangle turned over. Vertices keep their places and edges their vectors against
/// rows for the vertices and centres of triangles that are nearer than the gap; then comes
/// unfolded, which knows no body, and both again, four times. Cloth between two parts of the body
/// that overlap (thighs, an armpit) has nowhere to go and may stay inside. Our choice.
/// @param shapes  as of unfolded
Points clear_of_body(ShapeSolver& solver, const ClothModel& model, Points x,
                     const BodyObstacle& body, double gap, const std::vector<Points>& shapes = {});

}  // namespace atelier
