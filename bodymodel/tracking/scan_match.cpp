#include "bodymodel/tracking/scan_match.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kFirstReach = 0.01;  // m, asked for first: most points are nearer, found sooner
constexpr double kSideways = 2;  // times the scan's spacing: beside its nearest point is a hole

/// About `count` rows, evenly over the area; successive turns choose other ones.
std::vector<Index> sampled_rows(const Eigen::VectorXd& areas, Index count, int turn) {
  const double step = areas.sum() / static_cast<double>(count);
  // The golden ratio spreads the offsets of successive turns.
  constexpr double kGolden = 0.618033988749895;
  double next = step * std::fmod(0.5 + kGolden * turn, 1.0);
  double along = 0;
  std::vector<Index> kept;
  for (Index i = 0; i < areas.size(); ++i) {
    along += areas[i];
    if (along > next) {
      kept.push_back(i);
      next += step * std::ceil((along - next) / step);
    }
  }
  return kept;
}

/// Normals of the vertices, faces weighed by their areas: of a body's isotropic triangles as good
/// as by their angles, which cost ten times as much.
Points plain_normals(const Points& vertices, const Triangles& faces) {
  std::vector<Vec3d> sums(static_cast<std::size_t>(vertices.rows()), Vec3d{0, 0, 0});
  const auto at = [&](int v) { return Vec3d{vertices(v, 0), vertices(v, 1), vertices(v, 2)}; };
  for (Index f = 0; f < faces.rows(); ++f) {
    const int* face = faces.data() + 3 * f;
    const Vec3d a = at(face[0]);
    const Vec3d twice = cross(at(face[1]) - a, at(face[2]) - a);
    for (int c = 0; c < 3; ++c) {
      sums[static_cast<std::size_t>(face[c])] += twice;
    }
  }
  Points normals(vertices.rows(), 3);
  for (Index v = 0; v < vertices.rows(); ++v) {
    const Vec3d sum = sums[static_cast<std::size_t>(v)];
    const double length = norm(sum);
    const Vec3d unit = length > 1e-14 ? (1 / length) * sum : Vec3d{0, 0, 0};
    normals.row(v) << unit.x, unit.y, unit.z;
  }
  return normals;
}

}  // namespace

ScanPoints scan_points(const Mesh& scan, const std::vector<ScanPart>& parts) {
  ATELIER_CHECK(parts.empty() || static_cast<Index>(parts.size()) == scan.vertices.rows(),
                "a part for each vertex of the scan");
  const Points normals = scan.normals.rows() == scan.vertices.rows()
                             ? scan.normals
                             : vertex_normals(scan.vertices, scan.faces);
  const Eigen::VectorXd areas = vertex_areas(scan.vertices, scan.faces);
  std::vector<Index> kept;
  for (Index v = 0; v < scan.vertices.rows(); ++v) {
    if (areas[v] > 0 && normals.row(v).squaredNorm() > 0.5) {
      kept.push_back(v);
    }
  }
  ScanPoints result;
  const auto count = static_cast<Index>(kept.size());
  result.points.resize(count, 3);
  result.normals.resize(count, 3);
  result.areas.resize(count);
  for (Index i = 0; i < count; ++i) {
    const Index v = kept[static_cast<std::size_t>(i)];
    result.points.row(i) = scan.vertices.row(v);
    result.normals.row(i) = normals.row(v);
    result.areas[i] = areas[v];
    result.parts.push_back(parts.empty() ? ScanPart::Cloth : parts[static_cast<std::size_t>(v)]);
  }
  return result;
}

std::string scan_size_problem(const ScanPoints& scan, const Points& person) {
  constexpr double kFarUnit = 3;  // times the person's size that no scan has
  const auto size_of = [](const Points& points) {
    return (points.colwise().maxCoeff() - points.colwise().minCoeff()).maxCoeff();
  };
  const double size = size_of(scan.points);
  const double person_size = size_of(person);
  if (size <= kFarUnit * person_size && size >= person_size / kFarUnit / 2) {
    return "";
  }
  return "a scan of " + short_number(size) + " m of a person of " + short_number(person_size, 3) +
         " m";
}

ScanPoints sampled(const ScanPoints& scan, Index count, int turn) {
  if (scan.points.rows() <= count || count <= 0) {
    return scan;
  }
  const double total = scan.areas.sum();
  const std::vector<Index> kept = sampled_rows(scan.areas, count, turn);
  ScanPoints result;
  const auto rows = static_cast<Index>(kept.size());
  result.points.resize(rows, 3);
  result.normals.resize(rows, 3);
  result.areas = Eigen::VectorXd::Constant(rows, total / static_cast<double>(rows));
  for (Index i = 0; i < rows; ++i) {
    const Index from = kept[static_cast<std::size_t>(i)];
    result.points.row(i) = scan.points.row(from);
    result.normals.row(i) = scan.normals.row(from);
    result.parts.push_back(scan.parts[static_cast<std::size_t>(from)]);
  }
  return result;
}

BodySurface rest_surface(const FittedPerson& person) {
  BodySurface surface;
  surface.vertices = person.shaped.vertices;
  surface.normals = plain_normals(surface.vertices, person.model->mesh.faces);
  surface.tree = build_tree(surface.vertices, person.model->mesh.faces);
  return surface;
}

BodySurface posed_surface(const FittedPerson& person, const BodySurface& rest,
                          const Eigen::VectorXd& x) {
  BodySurface surface;
  surface.vertices = skin_vertices(*person.model, person.shaped, pose_of_variables(person, x));
  surface.normals = plain_normals(surface.vertices, person.model->mesh.faces);
  surface.tree = refit_tree(rest.tree, surface.vertices);
  return surface;
}

std::vector<SurfaceMatch> match_scan(const FittedPerson& person, const BodySurface& surface,
                                     const ScanPoints& scan, const std::vector<char>& region,
                                     const MatchOptions& options) {
  ATELIER_CHECK(region.empty() || static_cast<Index>(region.size()) == surface.vertices.rows(),
                "a region of the body's vertices");
  const double total = scan.areas.sum();
  std::vector<SurfaceMatch> matches;
  matches.reserve(scan.parts.size());
  for (Index i = 0; i < scan.points.rows(); ++i) {
    const ScanPart part = scan.parts[static_cast<std::size_t>(i)];
    if (part != ScanPart::Skin && part != ScanPart::Cloth) {
      continue;
    }
    const Eigen::Vector3d point = scan.points.row(i).transpose();
    ClosestPoint near = closest_point(surface.tree, point, std::min(kFirstReach, options.reach));
    if (near.face < 0) {
      near = closest_point(surface.tree, point, options.reach);
    }
    if (near.face < 0) {
      continue;
    }
    SurfaceMatch match;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Index heaviest = 0;
    near.barycentric.maxCoeff(&heaviest);
    for (int c = 0; c < 3; ++c) {
      const int vertex = person.model->mesh.faces(near.face, c);
      match.vertices[static_cast<std::size_t>(c)] = vertex;
      normal += near.barycentric[c] * surface.normals.row(vertex).transpose();
    }
    const int vertex = match.vertices[static_cast<std::size_t>(heaviest)];
    if (normal.norm() < 0.1 ||
        normal.normalized().dot(scan.normals.row(i).transpose()) < options.min_cosine ||
        (part == ScanPart::Cloth && !region.empty() &&
         region[static_cast<std::size_t>(vertex)] != 0)) {
      continue;
    }
    match.barycentric = near.barycentric;
    match.normal = normal.normalized();
    match.target = scan.points.row(i).transpose();
    match.weight = scan.areas[i] / total;
    match.cloth = part == ScanPart::Cloth;
    matches.push_back(match);
  }
  return matches;
}

ScanLookup scan_lookup(const ScanPoints& scan) {
  if (scan.points.rows() == 0) {
    return {};
  }
  // Few of the body's vertices ask: a coarse tree, quickly made.
  return {build_point_tree(scan.points, {.leaf_size = 16}),
          std::sqrt(scan.areas.sum() / static_cast<double>(scan.points.rows()))};
}

std::vector<SurfaceMatch> match_model(const BodySurface& surface, const Eigen::VectorXd& areas,
                                      const ScanPoints& scan, const ScanLookup& lookup,
                                      const AskingVertices& asking, const MatchOptions& options) {
  ATELIER_CHECK(areas.size() == surface.vertices.rows(), "an area for each vertex of the body");
  if (scan.points.rows() == 0) {
    return {};
  }
  const Index wanted = asking.count > 0 ? std::min(asking.count, areas.size()) : areas.size();
  const std::vector<Index> vertices = sampled_rows(areas, wanted, asking.turn);
  const double weight =
      areas.sum() / scan.areas.sum() / std::max(1.0, static_cast<double>(vertices.size()));
  std::vector<SurfaceMatch> matches;
  for (const Index v : vertices) {
    const Eigen::Vector3d at = surface.vertices.row(v).transpose();
    const ClosestPoint near = closest_point(lookup.tree, at, options.reach);
    if (near.face < 0 || scan.parts[static_cast<std::size_t>(near.face)] != ScanPart::Skin) {
      continue;
    }
    const Eigen::Vector3d normal = scan.normals.row(near.face).transpose();
    const Eigen::Vector3d apart = near.point - at;
    const double sideways = (apart - apart.dot(normal) * normal).norm();
    if (normal.dot(surface.normals.row(v).transpose()) < options.min_cosine ||
        sideways > kSideways * lookup.spacing) {
      continue;
    }
    SurfaceMatch match;
    const int vertex = static_cast<int>(v);
    match.vertices = {vertex, vertex, vertex};
    match.barycentric = {1, 0, 0};
    match.normal = normal;
    match.target = near.point;
    match.weight = weight;
    matches.push_back(match);
  }
  return matches;
}

MatchError match_error(const Points& vertices, const std::vector<SurfaceMatch>& matches) {
  MatchError error;
  double sum = 0;
  for (const SurfaceMatch& match : matches) {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (int c = 0; c < 3; ++c) {
      at += match.barycentric[c] *
            vertices.row(match.vertices[static_cast<std::size_t>(c)]).transpose();
    }
    const double gap = match.normal.dot(at - match.target);
    sum += match.weight * gap * gap;
    error.share += match.weight;
  }
  error.rms = error.share > 0 ? std::sqrt(sum / error.share) : 0;
  return error;
}

double foreign_share(const FittedPerson& person, const BodySurface& surface,
                     const ScanPoints& scan) {
  const ScanPoints points = sampled(scan, 500);
  double judged = 0;
  for (Index i = 0; i < points.areas.size(); ++i) {
    judged += points.parts[static_cast<std::size_t>(i)] == ScanPart::LeftOut ? 0 : points.areas[i];
  }
  judged /= points.areas.sum();
  const double on =
      match_error(surface.vertices, match_scan(person, surface, points, {}, {0.4, -1})).share;
  return judged > 0 ? 1 - on / judged : 0;
}

}  // namespace atelier
