#include "bodymodel/underlying/body_certificate.h"

#include <algorithm>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"

namespace atelier {

BodyCertificate body_certificate(const Triangles& faces, const Points& vertices,
                                 const ScanSurface& scan, const BodyCover& cover) {
  ATELIER_CHECK(cover.covered.size() == vertices.rows(), "cover of another body");
  BodyCertificate certificate;
  if (scan.vertices.rows() == 0) {
    return certificate;
  }
  constexpr double kReach = 0.05;     // m
  constexpr double kOutside = 0.001;  // m
  constexpr double kNear = 0.01;      // m
  constexpr double kSameWay = 0.5;    // cosine between skin and its scan
  const Points normals = vertex_normals(vertices, faces);
  const Eigen::VectorXd areas = vertex_areas(vertices, faces);
  std::vector<double> gaps(static_cast<std::size_t>(vertices.rows()), kReach);
  std::vector<double> skin(gaps.size(), kReach);
  parallel_for(vertices.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      const Eigen::Vector3d x = vertices.row(v).transpose();
      const Eigen::Vector3d normal = normals.row(v).transpose();
      if (cover.covered[v] > 0.5) {
        if (const auto over = cover_gap(scan, x, normal, kReach, CoverSign::Winding)) {
          gaps[static_cast<std::size_t>(v)] = over->gap;
        }
      } else if (const auto seen = nearest_point(scan, scan.skin, x, kReach);
                 seen && !seen->border && seen->normal.dot(normal) > kSameWay) {
        skin[static_cast<std::size_t>(v)] = seen->distance;
      }
    }
  });
  Index outside = 0;
  Index near = 0;
  double seen_area = 0;
  for (std::size_t v = 0; v < gaps.size(); ++v) {
    const bool has_gap = gaps[v] < kReach;
    const bool has_skin = skin[v] < kReach;
    seen_area += has_gap || has_skin ? areas[static_cast<Index>(v)] : 0;
    if (has_skin) {
      ++certificate.bare;
      certificate.skin_distance += skin[v];
    }
    if (!has_gap) {
      continue;
    }
    ++certificate.covered;
    if (gaps[v] < -kOutside) {
      ++outside;
      certificate.outside_depth -= gaps[v];
    } else if (gaps[v] < kNear) {
      ++near;
      certificate.proximity += std::max(gaps[v], 0.0);
    }
  }
  const auto mean = [](double sum, Index count) {
    return count > 0 ? sum / static_cast<double>(count) : 0;
  };
  certificate.outside_rate = mean(static_cast<double>(outside), certificate.covered);
  certificate.outside_depth = mean(certificate.outside_depth, outside);
  certificate.proximity = mean(certificate.proximity, near);
  certificate.proximity_rate = mean(static_cast<double>(near), certificate.covered);
  certificate.skin_distance = mean(certificate.skin_distance, certificate.bare);
  const double area = areas.sum();
  certificate.seen_rate = area > 0 ? seen_area / area : 0;
  return certificate;
}

}  // namespace atelier
