#include "registration/tracking/clear_of_body.h"

#include <algorithm>

#include "core/depths_inside.h"
#include "core/intersection.h"
#include "registration/tracking/body_driven_prediction.h"
#include "registration/tracking/unfolded.h"

namespace atelier {

BodyContact body_contact(const Points& x, const Triangles& faces, const BodyObstacle& body) {
  BodyContact contact;
  if (body.faces.rows() == 0) {
    return contact;
  }
  const Index vertices = x.rows();
  Points points(vertices + faces.rows(), 3);
  points.topRows(vertices) = x;
  for (Index f = 0; f < faces.rows(); ++f) {
    points.row(vertices + f) = x(faces.row(f), Eigen::all).colwise().mean();
  }
  const Eigen::VectorXd depths = depths_inside(points, body.vertices, body.faces);
  contact.inside =
      static_cast<double>((depths.array() > 0).count()) / static_cast<double>(points.rows());
  contact.depth = depths.maxCoeff();

  Points both(vertices + body.vertices.rows(), 3);
  both << x, body.vertices;
  Triangles all(faces.rows() + body.faces.rows(), 3);
  all << faces, (body.faces.array() + static_cast<int>(vertices)).matrix();
  const auto pairs = self_intersections(both, all);
  contact.crossings =
      static_cast<int>(std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
        return pair[0] < faces.rows() && pair[1] >= faces.rows();
      }));
  return contact;
}

Points clear_of_body(ShapeSolver& solver, const ClothModel& model, Points x,
                     const BodyObstacle& body, double gap, const std::vector<Points>& shapes) {
  constexpr int kRounds = 4;
  constexpr int kSteps = 3;
  constexpr double kRigid =
      0.02;  // m, length over which cloth that is pushed takes its surroundings along
  constexpr double kWeight = 300;  // of the body against the place and shape that cloth has
  const Edges& edges = model.topology.edges;
  x = unfolded(model.topology, std::move(x), shapes).vertices;
  for (int round = 0; round < kRounds; ++round) {
    ClothTerms terms;
    terms.anchor_weights = model.areas;
    terms.anchors = x;
    terms.edge_weights = rigid_weights(model, kRigid);
    terms.edge_vectors = x(edges.col(0), Eigen::all) - x(edges.col(1), Eigen::all);
    int steps = 0;
    for (; steps < kSteps; ++steps) {
      terms.rows = body_rows(model, x, body, {.gap = gap, .weight = kWeight, .centres = true});
      if (terms.rows.empty()) {
        break;
      }
      x = solver.lower(terms, x);
    }
    if (steps == 0) {
      break;
    }
    x = unfolded(model.topology, std::move(x), shapes).vertices;
  }
  return x;
}

}  // namespace atelier
