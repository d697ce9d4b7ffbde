#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// Where each vertex of a template is on the true garment: the nearest material point in the
/// template's frame.
struct TrueBinding {
  std::vector<int> faces;                    ///< [V] of the true garment
  std::vector<Eigen::Vector3d> barycentric;  ///< [V]
  Eigen::VectorXd distances;                 ///< [V] m, to it
};

/// Binds the vertices to the nearest points of a surface. Throws LogicError for one without faces.
TrueBinding bind_to_truth(const Points& vertices, const Points& truth, const Triangles& faces);

/// Where those points are when the true garment is at `truth`, [V,3].
Points bound_points(const TrueBinding& binding, const Points& truth, const Triangles& faces);

/// Sums of errors of one registered frame, over what two cameras see.
struct RegistrationError {
  std::vector<double> points;      ///< m, of each vertex seen: to where its material point is
  std::vector<double> tangential;  ///< m, the part of it along the true surface
  double to_truth = 0;             ///< m, mean distance of seen vertices to the true surface
  double from_truth = 0;           ///< m, mean distance of seen true vertices to the garment
};

/// @param seen  [W] of each true vertex: 1 if two cameras see it; empty: all are seen
RegistrationError registration_error(const Points& vertices, const Triangles& faces,
                                     const TrueBinding& binding, const Points& truth,
                                     const Triangles& true_faces, const std::vector<char>& seen);

}  // namespace atelier
