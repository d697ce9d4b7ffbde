#include "registration/tracking/registration_error.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/tree.h"

namespace atelier {

TrueBinding bind_to_truth(const Points& vertices, const Points& truth, const Triangles& faces) {
  ATELIER_CHECK(faces.rows() > 0, "a true garment has faces");
  TrueBinding binding;
  binding.distances.resize(vertices.rows());
  Index v = 0;
  for (const ClosestPoint& closest : closest_points(build_tree(truth, faces), vertices)) {
    binding.faces.push_back(closest.face);
    binding.barycentric.push_back(closest.barycentric);
    binding.distances[v++] = std::sqrt(closest.squared_distance);
  }
  return binding;
}

Points bound_points(const TrueBinding& binding, const Points& truth, const Triangles& faces) {
  Points points = Points::Zero(static_cast<Index>(binding.faces.size()), 3);
  for (std::size_t v = 0; v < binding.faces.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      points.row(static_cast<Index>(v)) +=
          binding.barycentric[v][k] * truth.row(faces(binding.faces[v], k));
    }
  }
  return points;
}

RegistrationError registration_error(const Points& vertices, const Triangles& faces,
                                     const TrueBinding& binding, const Points& truth,
                                     const Triangles& true_faces, const std::vector<char>& seen) {
  ATELIER_CHECK(static_cast<Index>(binding.faces.size()) == vertices.rows(),
                "a binding of another template");
  RegistrationError error;
  const auto is_seen = [&](int vertex) {
    return seen.empty() || seen[static_cast<std::size_t>(vertex)] != 0;
  };
  const Points normals = vertex_normals(truth, true_faces);
  const Points points = bound_points(binding, truth, true_faces);
  const std::vector<ClosestPoint> onto = closest_points(build_tree(truth, true_faces), vertices);
  double sum = 0;
  for (std::size_t v = 0; v < binding.faces.size(); ++v) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    bool counts = true;
    for (int k = 0; k < 3; ++k) {
      const int corner = true_faces(binding.faces[v], k);
      counts = counts && is_seen(corner);
      normal += binding.barycentric[v][k] * normals.row(corner).transpose();
    }
    if (!counts) {
      continue;
    }
    normal.normalize();
    const auto row = static_cast<Index>(v);
    const Eigen::Vector3d off = (vertices.row(row) - points.row(row)).transpose();
    error.points.push_back(off.norm());
    error.tangential.push_back((off - off.dot(normal) * normal).norm());
    sum += std::sqrt(onto[v].squared_distance);
  }
  error.to_truth = error.points.empty() ? 0 : sum / static_cast<double>(error.points.size());
  const std::vector<ClosestPoint> back = closest_points(build_tree(vertices, faces), truth);
  double count = 0;
  sum = 0;
  for (std::size_t w = 0; w < back.size(); ++w) {
    if (is_seen(static_cast<int>(w))) {
      sum += std::sqrt(back[w].squared_distance);
      count += 1;
    }
  }
  error.from_truth = count > 0 ? sum / count : 0;
  return error;
}

}  // namespace atelier
