#include "bodymodel/underlying/underlying_body.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "bodymodel/surface_frames.h"
#include "bodymodel/underlying/vertex_energy.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/quantity_text.h"
#include "core/topology.h"

namespace atelier {
namespace {

constexpr double kSkinAlongScan = 0.5;  // cosine between skin and seen skin
constexpr double kMinGap = 0.5;         // of the usual one; closer, cloth pushes

/// Rotation that takes the edges around each vertex best from one shape to another.
std::vector<Eigen::Matrix3d> edge_rotations(const VertexEnergy& energy, const Points& from,
                                            const Points& to) {
  std::vector<Eigen::Matrix3d> spread(static_cast<std::size_t>(from.rows()),
                                      Eigen::Matrix3d::Zero());
  for (Index e = 0; e < energy.edges.rows(); ++e) {
    const int i = energy.edges(e, 0);
    const int j = energy.edges(e, 1);
    const Eigen::Matrix3d product =
        energy.edge_weights[e] * (to.row(i) - to.row(j)).transpose() * (from.row(i) - from.row(j));
    spread[static_cast<std::size_t>(i)] += product;
    spread[static_cast<std::size_t>(j)] += product;
  }
  parallel_for(from.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      auto& matrix = spread[static_cast<std::size_t>(v)];
      const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix,
                                                  Eigen::ComputeFullU | Eigen::ComputeFullV);
      Eigen::Vector3d turn(1, 1, 1);
      turn[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
      matrix = svd.matrixU() * turn.asDiagonal() * svd.matrixV().transpose();
    }
  });
  return spread;
}

PlaneRow vertex_row(Index v, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                    double weight, double scale) {
  const int at = static_cast<int>(v);
  PlaneRow row;
  row.vertices = {at, at, at};
  row.barycentric = {1, 0, 0};
  row.normal = normal;
  row.offset = normal.dot(point);
  row.weight = weight;
  row.scale = scale;
  return row;
}

/// Correspondences of each vertex with the scan: of bare ones the skin next to them, of covered
/// ones the cloth over them.
std::vector<PlaneRow> rows_of_body(const Triangles& faces, const Points& x, const ScanSurface& scan,
                                   const BodyCover& cover, const Eigen::VectorXd& areas,
                                   const UnderlyingBodyOptions& options) {
  const Points normals = vertex_normals(x, faces);
  std::vector<PlaneRow> rows(static_cast<std::size_t>(2 * x.rows()));
  parallel_for(x.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      const Eigen::Vector3d at = x.row(v).transpose();
      const Eigen::Vector3d normal = normals.row(v).transpose();
      const double covered = cover.covered[v];
      if (covered < 1) {
        const auto skin = nearest_point(scan, scan.skin, at, options.skin_reach);
        if (skin && !skin->border && skin->normal.dot(normal) > kSkinAlongScan) {
          rows[static_cast<std::size_t>(2 * v)] =
              vertex_row(v, skin->point, skin->normal,
                         0.5 * options.skin_weight * areas[v] * (1 - covered), options.skin_scale);
        }
      }
      if (covered > 0) {
        const auto over = cover_gap(scan, at, normal, options.cover_reach, options.sign);
        if (!over) {
          continue;
        }
        auto& row = rows[static_cast<std::size_t>(2 * v + 1)];
        const double usual = options.gap > 0 ? options.gap : cover.gap;
        const double least = kMinGap * usual;
        if (over->gap < least && options.sign != CoverSign::Unsigned) {
          row = vertex_row(v, over->point - least * over->outward, over->outward,
                           options.outside_weight * areas[v] * covered, 0);
        } else if (over->role == ScanRole::Cloth) {
          row = vertex_row(v, over->point - usual * over->outward, over->outward,
                           options.tight_weight * areas[v] * covered * cover.tightness[v],
                           options.tight_scale);
        }
      }
    }
  });
  std::erase_if(rows, [](const PlaneRow& row) { return row.weight <= 0; });
  return rows;
}

/// The body's vertices and distances of each point of seen skin.
std::vector<PlaneRow> rows_of_skin(const Triangles& faces, const Points& x,
                                   const TriangleTree& tree, const ScanSurface& scan,
                                   const BodyCover& cover, const UnderlyingBodyOptions& options) {
  const Points normals = face_normals(x, faces);
  const Index count = scan.vertices.rows();
  std::vector<PlaneRow> rows(static_cast<std::size_t>(count));
  parallel_for(count, 256, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      if (scan.roles[static_cast<std::size_t>(i)] != ScanRole::Skin) {
        continue;
      }
      const Eigen::Vector3d point = scan.vertices.row(i).transpose();
      const Eigen::Vector3d normal = scan.normals.row(i).transpose();
      const ClosestPoint closest = closest_point(tree, point, options.skin_reach);
      if (closest.face < 0 || normals.row(closest.face).transpose().dot(normal) < kSkinAlongScan) {
        continue;
      }
      double bare = 0;
      PlaneRow row;
      for (int k = 0; k < 3; ++k) {
        row.vertices[static_cast<std::size_t>(k)] = faces(closest.face, k);
        bare += closest.barycentric[k] * (1 - cover.covered[faces(closest.face, k)]);
      }
      row.barycentric = closest.barycentric;
      row.normal = normal;
      row.offset = normal.dot(point);
      row.weight = 0.5 * options.skin_weight * scan.areas[i] * bare;
      row.scale = options.skin_scale;
      rows[static_cast<std::size_t>(i)] = row;
    }
  });
  std::erase_if(rows, [](const PlaneRow& row) { return row.weight <= 0; });
  return rows;
}

/// The vertices' energy without what the scan says: edges and places of a shape.
VertexEnergy energy_of_shape(const Triangles& faces, const Points& shape,
                             const Eigen::VectorXd& areas, const UnderlyingBodyOptions& options) {
  VertexEnergy energy;
  energy.edges.resize(0, 2);
  if (options.coupling) {
    const Topology topology = topology_of(faces, shape.rows());
    energy.edges = topology.edges;
    energy.edge_weights =
        options.coupling_length * options.coupling_length * edge_weights(topology, shape);
  }
  const double least = areas.size() > 0 ? 1e-3 * areas.mean() : 0;  // of vertices without a face
  energy.anchor_weights = options.anchor_weight * areas.cwiseMax(least);
  energy.anchors = shape;
  return energy;
}

/// The edges of a shape, turned as the body has turned about each of them.
Points turned_edges(const VertexEnergy& energy, const Points& shape, const Points& body) {
  const std::vector<Eigen::Matrix3d> rotations = edge_rotations(energy, shape, body);
  Points vectors(energy.edges.rows(), 3);
  for (Index e = 0; e < energy.edges.rows(); ++e) {
    const int a = energy.edges(e, 0);
    const int b = energy.edges(e, 1);
    const Eigen::Matrix3d& first = rotations[static_cast<std::size_t>(a)];
    const Eigen::Matrix3d& second = rotations[static_cast<std::size_t>(b)];
    vectors.row(e) = 0.5 * (shape.row(a) - shape.row(b)) * (first + second).transpose();
  }
  return vectors;
}

/// How much the rows say of each vertex, against what seen skin says.
Eigen::VectorXd support_of(const std::vector<PlaneRow>& rows, const Points& body,
                           const Eigen::VectorXd& areas) {
  Eigen::VectorXd support = Eigen::VectorXd::Zero(body.rows());
  for (const PlaneRow& row : rows) {
    const double weight = row_weight(row, body);
    for (int k = 0; k < 3; ++k) {
      support[row.vertices[static_cast<std::size_t>(k)]] += weight * row.barycentric[k];
    }
  }
  for (Index v = 0; v < support.size(); ++v) {
    support[v] = areas[v] > 0 ? std::min(1.0, support[v] / areas[v]) : 0;
  }
  return support;
}

/// A body and how much the scan says of each vertex.
struct Fitted {
  Points body;
  Eigen::VectorXd support;
};

Fitted fitted(const Triangles& faces, const Points& shape, Points body, const ScanSurface& scan,
              const BodyCover& cover, const UnderlyingBodyOptions& options) {
  constexpr double kSettled = 3e-5;  // m, mean move of a round
  const Eigen::VectorXd areas = vertex_areas(shape, faces);
  VertexEnergy energy = energy_of_shape(faces, shape, areas, options);
  TriangleTree tree = build_tree(body, faces);
  for (int i = 0; i < options.iterations; ++i) {
    energy.edge_vectors = turned_edges(energy, shape, body);
    energy.rows = rows_of_body(faces, body, scan, cover, areas, options);
    const std::vector<PlaneRow> skin = rows_of_skin(faces, body, tree, scan, cover, options);
    energy.rows.insert(energy.rows.end(), skin.begin(), skin.end());
    const Points before = std::exchange(body, lower_vertex_energy(energy, body));
    if ((body - before).rowwise().norm().mean() < kSettled) {
      break;
    }
    tree = refit_tree(std::move(tree), body);
  }
  Eigen::VectorXd support = support_of(energy.rows, body, areas);
  return {std::move(body), std::move(support)};
}

}  // namespace

OptionTable describe(UnderlyingBodyOptions& options) {
  OptionTable table;
  table.add("iterations", options.iterations, 1, 100, "",
            "Number of rounds of finding ICP correspondences and solving");
  table.add("sign", options.sign,
            {{"winding", CoverSign::Winding},
             {"normal", CoverSign::Normal},
             {"unsigned", CoverSign::Unsigned}},
            "Test of inside and outside of clothes; all but winding are for comparison");
  table.add(
      "coupling", options.coupling,
      "Preservation of the personal body's shape where nothing is seen; off only for comparison");
  table.add("temporal", options.temporal,
            "Preservation of the shape of the frames before and after");
  table.add("coupling_length", options.coupling_length, 0.001, 1, "m",
            "Length over which skin follows its neighbours against the data; larger is smoother");
  table.add("anchor_weight", options.anchor_weight, 1e-6, 100, "",
            "Weight of the personal body's own position, relative to seen skin at 1");
  table.add("skin_weight", options.skin_weight, 0, 1000, "", "Weight of seen skin");
  table.add(
      "skin_reach", options.skin_reach, 0.001, 1, "m",
      "Maximum distance of ICP correspondences of skin; raise it where tracking is inaccurate");
  table.add("skin_scale", options.skin_scale, 0.0001, 1, "m",
            "Distance at which points of skin are treated as outliers");
  table.add("cover_reach", options.cover_reach, 0.001, 1, "m",
            "Maximum depth of penetrations through clothes that are corrected");
  table.add("outside_weight", options.outside_weight, 0, 1000, "",
            "Weight that keeps skin inside of clothes");
  table.add("gap", options.gap, 0, 0.05, "m",
            "Gap between clothes and skin where clothes lie on it; 0: estimated as the most "
            "frequent one");
  table.add("tight_weight", options.tight_weight, 0, 1000, "",
            "Weight of skin under tight clothes");
  table.add("tight_scale", options.tight_scale, 0.0001, 1, "m",
            "Gap beyond which clothes no longer attract the skin below");
  table.add("temporal_weight", options.temporal_weight, 0, 1, "",
            "Fraction of the neighbouring frames' offsets in the shape that is preserved");
  return table;
}

std::vector<Finding> underlying_findings(const ScanSurface& scan,
                                         const BodyCertificate& certificate) {
  std::vector<Finding> findings;
  const auto warn = [&](const char* code, std::string what, std::string advice) {
    findings.push_back({Severity::Warning, code, "", std::move(what), std::move(advice)});
  };
  if (scan.vertices.rows() == 0) {
    warn("no-scan", "there is no scan: the body is the tracked one alone", "");
    return findings;
  }
  constexpr double kHalf = 0.5;
  if (certificate.seen_rate < kHalf) {
    warn("little-seen",
         "only " + percent(certificate.seen_rate) + " of the body's surface has a scan near it",
         "compare scan and pose in the report; the rest follows the personal body");
  }
  if (scan.skin.faces.rows() == 0) {
    warn("no-skin", "no part of the scan is labelled skin, so the body is only kept inside of it",
         "label images tell skin from clothing (docs/methods/surfaces.md)");
  }
  return findings;
}

UnderlyingBody underlying_body(const Triangles& faces, const Points& posed, const ScanSurface& scan,
                               const BodyCover& cover, const KnownOffsets& known,
                               const UnderlyingBodyOptions& options) {
  const Index count = posed.rows();
  ATELIER_CHECK(cover.covered.size() == count && cover.tightness.size() == count,
                "cover of another body");
  ATELIER_CHECK(known.usual.rows() == 0 || known.usual.rows() == count, "offsets of another body");
  ATELIER_CHECK(known.start.rows() == 0 || known.start.rows() == count, "offsets of another body");
  ATELIER_CHECK(posed.allFinite() && known.usual.allFinite() && known.start.allFinite(),
                "coordinates must be finite");
  const std::vector<Eigen::Matrix3d> frames = surface_frames(posed, faces);
  Points shape = posed;  // that is kept
  if (options.temporal && known.usual.rows() > 0) {
    shape += options.temporal_weight * from_surface_frames(frames, known.usual);
  }
  UnderlyingBody body;
  body.vertices =
      known.start.rows() > 0 ? Points(posed + from_surface_frames(frames, known.start)) : shape;
  if (scan.vertices.rows() > 0) {
    Fitted fit = fitted(faces, shape, std::move(body.vertices), scan, cover, options);
    body.vertices = std::move(fit.body);
    body.support = std::move(fit.support);
  } else {
    body.vertices = shape;
    body.support = Eigen::VectorXd::Zero(count);
  }
  body.offsets = in_surface_frames(frames, body.vertices - posed);
  body.certificate = body_certificate(faces, body.vertices, scan, cover);
  body.findings = underlying_findings(scan, body.certificate);
  body.trusted = body.findings.empty();
  return body;
}

}  // namespace atelier
