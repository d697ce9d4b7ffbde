#include "pipeline/avatar/surface_faults.h"

#include <algorithm>

#include "core/error.h"

namespace atelier {
namespace {

/// Twice the area of a face along its normal.
Eigen::Vector3d area_of(const Points& vertices, const Triangles& faces, Index f) {
  const Eigen::Vector3d corner = vertices.row(faces(f, 0));
  const Eigen::Vector3d second = vertices.row(faces(f, 1));
  const Eigen::Vector3d third = vertices.row(faces(f, 2));
  return (second - corner).cross(third - corner);
}

double length_of(const Points& vertices, int from, int to) {
  constexpr double kShortest = 0.001;  // m
  return kShortest + (vertices.row(from) - vertices.row(to)).norm();
}

}  // namespace

SurfaceFaults surface_faults(const Triangles& faces, const Points& rest_body,
                             const Points& rest_seen, const Points& body, const Points& seen) {
  ATELIER_CHECK(rest_seen.rows() == rest_body.rows() && body.rows() == rest_body.rows() &&
                    seen.rows() == rest_body.rows(),
                "one body has as many vertices in every pose");
  SurfaceFaults faults;
  for (Index f = 0; f < faces.rows(); ++f) {
    const bool at_rest = area_of(rest_seen, faces, f).dot(area_of(rest_body, faces, f)) < 0;
    const bool posed = area_of(seen, faces, f).dot(area_of(body, faces, f)) < 0;
    faults.inverted += posed && !at_rest ? 1 : 0;
    for (Index k = 0; k < 3; ++k) {
      const int from = faces(f, k);
      const int to = faces(f, (k + 1) % 3);
      faults.stretch = std::max(faults.stretch,
                                length_of(seen, from, to) * length_of(rest_body, from, to) /
                                    (length_of(body, from, to) * length_of(rest_seen, from, to)));
    }
  }
  return faults;
}

}  // namespace atelier
