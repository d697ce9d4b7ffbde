#include "bodymodel/underlying/clothed_scan.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"
#include "core/normals.h"
#include "core/quantity_text.h"
#include "core/topology.h"

namespace atelier {
namespace {

constexpr double kClothAlongSkin = 0.3;  // cosine between skin and what is over it; folds turn away
constexpr double kBeside = 0.01;         // m from cloth, where inside is asked for; our choice
constexpr double kMinBehind = 0.002;     // m
constexpr double kFall = 0.25;           // of the winding number; 1 of a whole surface
constexpr double kAlong = 0.5;           // cosine between a gap and the cloth's normal
constexpr double kOnSurface = 1e-3;      // m, nearer than this directions say nothing
constexpr double kWindingAccuracy = 2;   // an error of 1e-2 does not matter here

ScanRole role_of_face(const std::vector<ScanRole>& roles, const Eigen::Vector3i& face) {
  const ScanRole a = roles[static_cast<std::size_t>(face[0])];
  const ScanRole b = roles[static_cast<std::size_t>(face[1])];
  const ScanRole c = roles[static_cast<std::size_t>(face[2])];
  if (a == b || a == c) {
    return a;
  }
  return b == c ? b : ScanRole::Ignored;
}

ScanRegion region_of(const Mesh& mesh, const std::vector<ScanRole>& face_roles, bool skin) {
  ScanRegion region;
  std::vector<Index> kept;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const ScanRole role = face_roles[static_cast<std::size_t>(f)];
    const bool wanted =
        skin ? role == ScanRole::Skin : role == ScanRole::Cloth || role == ScanRole::Cover;
    if (wanted) {
      kept.push_back(f);
      region.face_roles.push_back(role);
    }
  }
  region.faces.resize(static_cast<Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    region.faces.row(static_cast<Index>(i)) = mesh.faces.row(kept[i]);
  }
  region.border.assign(kept.size(), 0);
  if (kept.empty()) {
    return region;
  }
  region.tree = build_tree(mesh.vertices, region.faces);
  const Topology topology = topology_of(region.faces, mesh.vertices.rows());
  std::vector<char> rim(static_cast<std::size_t>(mesh.vertices.rows()), 0);
  const auto is_border = [&](int edge) {
    return edge >= 0 && corners_of_edge(topology, edge).size() == 1;
  };
  for (Index f = 0; f < region.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      if (is_border(topology.face_edges(f, k))) {
        region.border[static_cast<std::size_t>(f)] |= static_cast<std::uint8_t>(1 << k);
        rim[static_cast<std::size_t>(region.faces(f, k))] = 1;
        rim[static_cast<std::size_t>(region.faces(f, (k + 1) % 3))] = 1;
      }
    }
  }
  for (Index f = 0; f < region.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      if (rim[static_cast<std::size_t>(region.faces(f, k))] != 0) {
        region.border[static_cast<std::size_t>(f)] |= static_cast<std::uint8_t>(8 << k);
      }
    }
  }
  return region;
}

/// True if a point of a face is on the region's border.
bool on_border(std::uint8_t border, const Eigen::Vector3d& barycentric) {
  constexpr double kZero = 1e-9;
  for (int k = 0; k < 3; ++k) {
    const bool on_edge = barycentric[(k + 2) % 3] < kZero;
    const bool on_corner = on_edge && barycentric[(k + 1) % 3] < kZero;
    if ((on_edge && (border >> k & 1) != 0) || (on_corner && (border >> (3 + k) & 1) != 0)) {
      return true;
    }
  }
  return false;
}

/// Of a region: where it is nearest, without its normal, which damaged faces may not have.
struct Nearest {
  ClosestPoint closest;
  bool border = false;
  ScanRole role = ScanRole::Ignored;
};

std::optional<Nearest> nearest_of(const ScanRegion& region, const Eigen::Vector3d& query,
                                  double reach) {
  if (region.faces.rows() == 0) {
    return std::nullopt;
  }
  const ClosestPoint closest = closest_point(region.tree, query, reach);
  if (closest.face < 0) {
    return std::nullopt;
  }
  const auto face = static_cast<std::size_t>(closest.face);
  return Nearest{closest, on_border(region.border[face], closest.barycentric),
                 region.face_roles[face]};
}

/// Positive on the inside of the scan's surface at a point of it, seen from `way` behind it: the
/// winding number falls by 1 from inside to outside, whatever an open scan adds to both.
double fall_across(const ScanSurface& scan, const Eigen::Vector3d& surface,
                   const Eigen::Vector3d& direction, double way) {
  const double before = std::min(way, kBeside);
  const double behind = std::clamp(way, kMinBehind, kBeside);
  const WindingOptions quick{kWindingAccuracy};
  return winding_number(scan.winding, surface - before * direction, quick) -
         winding_number(scan.winding, surface + behind * direction, quick);
}

/// The side of the cloth that the skin is on, by the winding number; no normal of the scan is
/// asked. From inside, cloth that is over the skin lies where the skin looks, from outside behind
/// it.
std::optional<CoverGap> gap_by_winding(const ScanSurface& scan, const Eigen::Vector3d& skin,
                                       const Eigen::Vector3d& normal, double reach) {
  const auto at = nearest_of(scan.cover, skin, reach);
  if (!at || at->border) {
    return std::nullopt;
  }
  const double distance = std::sqrt(at->closest.squared_distance);
  CoverGap found{at->closest.point, normal, 0, at->role};
  if (distance <= kOnSurface) {
    found.gap = fall_across(scan, found.point, normal, distance) > 0 ? distance : -distance;
    return found;
  }
  const Eigen::Vector3d direction = (at->closest.point - skin) / distance;
  const double fall = fall_across(scan, found.point, direction, distance);
  found.gap = fall > 0 ? distance : -distance;
  found.outward = (fall > 0 ? 1 : -1) * direction;
  if (std::abs(fall) < kFall || found.outward.dot(normal) < kClothAlongSkin) {
    return std::nullopt;
  }
  return found;
}

std::optional<CoverGap> gap_by_normals(const ScanSurface& scan, const Eigen::Vector3d& skin,
                                       const Eigen::Vector3d& normal, double reach,
                                       CoverSign sign) {
  const auto at = nearest_point(scan, scan.cover, skin, reach);
  if (!at || at->border || at->normal.dot(normal) < kClothAlongSkin) {
    return std::nullopt;
  }
  CoverGap found{at->point, at->normal, 0, at->role};
  const Eigen::Vector3d to_cover = at->point - skin;
  const double along = to_cover.dot(at->normal);
  if (at->distance > kOnSurface) {
    if (std::abs(along) < kAlong * at->distance) {
      return std::nullopt;
    }
    found.outward = (along > 0 ? 1 : -1) / at->distance * to_cover;
  }
  found.gap = along > 0 ? at->distance : -at->distance;
  if (sign == CoverSign::Unsigned && found.gap < 0) {
    found.gap = -found.gap;
    found.outward = -found.outward;
  }
  return found;
}

}  // namespace

ScanSurface scan_surface(const ClothedScan& scan, const std::string& file) {
  check_mesh(scan.mesh, file);
  const auto count = static_cast<std::size_t>(scan.mesh.vertices.rows());
  if (!scan.roles.empty() && scan.roles.size() != count) {
    throw DataError(file, "roles", std::to_string(scan.roles.size()),
                    "one for each of " + std::to_string(count) + " vertices, or none");
  }
  ScanSurface surface;
  if (count == 0) {
    return surface;
  }
  if (scan.mesh.faces.rows() == 0) {
    throw DataError(file, "faces", "none",
                    "a surface; points alone do not tell inside from outside");
  }
  surface.vertices = scan.mesh.vertices;
  surface.normals = vertex_normals(scan.mesh.vertices, scan.mesh.faces);
  surface.areas = vertex_areas(scan.mesh.vertices, scan.mesh.faces);
  surface.roles = scan.roles.empty() ? std::vector<ScanRole>(count, ScanRole::Cloth) : scan.roles;
  std::vector<ScanRole> face_roles(static_cast<std::size_t>(scan.mesh.faces.rows()));
  for (Index f = 0; f < scan.mesh.faces.rows(); ++f) {
    face_roles[static_cast<std::size_t>(f)] =
        role_of_face(surface.roles, scan.mesh.faces.row(f).transpose());
  }
  surface.skin = region_of(scan.mesh, face_roles, true);
  surface.cover = region_of(scan.mesh, face_roles, false);
  surface.winding = build_winding_tree(scan.mesh.vertices, scan.mesh.faces);
  return surface;
}

std::optional<ScanPoint> nearest_point(const ScanSurface& scan, const ScanRegion& region,
                                       const Eigen::Vector3d& query, double reach) {
  const auto at = nearest_of(region, query, reach);
  if (!at) {
    return std::nullopt;
  }
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    normal += at->closest.barycentric[k] *
              scan.normals.row(region.faces(at->closest.face, k)).transpose();
  }
  const double length = normal.norm();
  if (!(length > 1e-6)) {
    return std::nullopt;
  }
  return ScanPoint{at->closest.point, normal / length, std::sqrt(at->closest.squared_distance),
                   at->border, at->role};
}

std::optional<CoverGap> cover_gap(const ScanSurface& scan, const Eigen::Vector3d& skin,
                                  const Eigen::Vector3d& normal, double reach, CoverSign sign) {
  return sign == CoverSign::Winding ? gap_by_winding(scan, skin, normal, reach)
                                    : gap_by_normals(scan, skin, normal, reach, sign);
}

bool looks_at_cover(const ScanSurface& scan, const Eigen::Vector3d& skin,
                    const Eigen::Vector3d& normal, double reach) {
  if (scan.cover.faces.rows() == 0 || normal.squaredNorm() < 0.5) {
    return false;
  }
  const RayHit hit = first_hit(scan.winding.tree, {skin, normal, 0, reach});
  if (hit.face < 0) {
    return false;
  }
  // Which region the face is in: the nearest point of the cover to the hit is the hit.
  const auto at = nearest_point(scan, scan.cover, skin + hit.t * normal, 1e-6);
  return at && std::abs(at->normal.dot(normal)) > kClothAlongSkin &&
         fall_across(scan, at->point, normal, hit.t) > kFall;
}

double share_off_body(const ScanSurface& scan, const Triangles& faces, const Points& body,
                      double reach) {
  const TriangleTree tree = build_tree(body, faces);
  double off = 0;
  for (Index v = 0; v < scan.vertices.rows(); ++v) {
    const Eigen::Vector3d at = scan.vertices.row(v).transpose();
    off += closest_point(tree, at, reach).face < 0 ? scan.areas[v] : 0;
  }
  const double all = scan.areas.sum();
  return all > 0 ? off / all : 0;
}

void check_scan_of_body(const ClothedScan& scan, const Points& body, const std::string& file) {
  if (scan.mesh.vertices.rows() == 0 || body.rows() == 0) {
    return;
  }
  const auto size = [](const Points& points) {
    return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
  };
  const double scan_size = size(scan.mesh.vertices);
  const double body_size = size(body);
  if (!(scan_size <= 3 * body_size && scan_size >= 0.1 * body_size)) {
    throw DataError(file, "vertices",
                    "a scan of " + short_number(scan_size) + " m across for a body of " +
                        short_number(body_size) + " m",
                    "metres; a scan in millimetres is to be scaled by 0.001");
  }
  const Eigen::RowVector3d apart = scan.mesh.vertices.colwise().mean() - body.colwise().mean();
  if (!(apart.norm() <= body_size)) {
    throw DataError(file, "vertices",
                    "a scan " + short_number(apart.norm()) + " m away from the body",
                    "scan and body in the same coordinates");
  }
}

}  // namespace atelier
