#include "capture/surface/occluding_contours.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/laplacian.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr int kRounds = 2;             // of looking for edges
constexpr int kReweighted = 5;         // least squares in each, with new weights of outliers
constexpr int kNormalRounds = 3;       // of means over neighbours: noise makes contours of its own
constexpr double kOffSurface = 0.004;  // m: the contour's own faces do not hide it
constexpr double kStep = 0.5;          // px, between samples across a contour
constexpr double kMinChange = 0.02;    // linear light a pixel, that is an edge
constexpr double kAlike = 3;           // px along a contour, over which edges err alike
constexpr double kOutlier = 3;         // deviations, from which an edge is another thing's
constexpr double kMargin = 3;          // px beyond the reach that must be empty too

struct View {
  const Camera& camera;
  const Image& image;
  const ByteImage& mask;
};

/// How far an image puts the surface from where it is, at a point of a face.
struct ContourMove {
  Eigen::Vector3i vertices;
  Eigen::Vector3d barycentric;
  double along = 0;      // m, along the normal
  double deviation = 0;  // m
  double count = 0;      // of independent edges that it stands for
};

/// Colour at a place in pixels, bilinear; the border's beyond it.
Eigen::Vector3d bilinear_color(const Image& image, const Eigen::Vector2d& place) {
  const double x = std::clamp(place.x() - 0.5, 0.0, image.width - 1.0);
  const double y = std::clamp(place.y() - 0.5, 0.0, image.height - 1.0);
  const int left = std::min(saturating_cast<int>(x), image.width - 1);
  const int top = std::min(saturating_cast<int>(y), image.height - 1);
  const int right = std::min(left + 1, image.width - 1);
  const int bottom = std::min(top + 1, image.height - 1);
  Eigen::Vector3d color;
  for (int c = 0; c < 3; ++c) {
    const double above =
        image.at(left, top, c) * (left + 1 - x) + image.at(right, top, c) * (x - left);
    const double below =
        image.at(left, bottom, c) * (left + 1 - x) + image.at(right, bottom, c) * (x - left);
    color[c] = above * (top + 1 - y) + below * (y - top);
  }
  return color;
}

/// True if the mask has the subject on the inner side of a contour and nobody on the outer one.
bool before_background(const ByteImage& mask, const Eigen::Vector2d& pixel,
                       const Eigen::Vector2d& outward, double reach) {
  const auto is = [&](double along, bool subject) {
    const Eigen::Vector2d at = pixel + along * outward;
    return at.x() >= 0 && at.y() >= 0 && at.x() < mask.width && at.y() < mask.height &&
           (mask.at(saturating_cast<int>(at.x()), saturating_cast<int>(at.y())) != 0) == subject;
  };
  for (double along = reach - 1; along <= reach + kMargin; along += 1) {
    if (!is(along, false)) {
      return false;
    }
  }
  return is(-reach, true) && is(1 - reach, true);
}

/// Pixels along `outward` at which the image changes most, places nearby preferred.
std::optional<double> edge_across(const Image& image, const Eigen::Vector2d& pixel,
                                  const Eigen::Vector2d& outward, double reach) {
  const int half = saturating_cast<int>(reach / kStep);
  std::vector<double> changes;
  for (int i = -half; i <= half; ++i) {
    changes.push_back((bilinear_color(image, pixel + (i * kStep + 0.5) * outward) -
                       bilinear_color(image, pixel + (i * kStep - 0.5) * outward))
                          .norm());
  }
  std::size_t best = 0;
  double most = 0;
  for (std::size_t i = 1; i + 1 < changes.size(); ++i) {
    const double off = (static_cast<int>(i) - half) * kStep * 2 / reach;
    const double preferred = changes[i] * std::exp(-0.5 * off * off);
    if (preferred > most) {
      most = preferred;
      best = i;
    }
  }
  if (best == 0 || changes[best] < kMinChange || changes[best] < changes[best - 1] ||
      changes[best] < changes[best + 1]) {
    return std::nullopt;
  }
  const double bend = changes[best - 1] - 2 * changes[best] + changes[best + 1];
  const double top = bend < 0 ? 0.5 * (changes[best - 1] - changes[best + 1]) / bend : 0;
  return (static_cast<int>(best) - half + top) * kStep;
}

/// The contour of the view through one face, and how far off the image has it.
std::optional<ContourMove> move_of_face(const View& view, const TriangleTree& tree,
                                        const Mesh& mesh, const Points& normals,
                                        const Eigen::Vector3i& face,
                                        const ContourOptions& options) {
  const Eigen::Vector3d centre = camera_center(view.camera);
  std::array<double, 3> facing{};
  for (std::size_t k = 0; k < 3; ++k) {
    facing[k] = normals.row(face[static_cast<int>(k)])
                    .dot(centre.transpose() - mesh.vertices.row(face[static_cast<int>(k)]));
  }
  std::vector<Eigen::Vector3d> ends;  // barycentric, where the contour crosses the face's edges
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const double a = facing[static_cast<std::size_t>(k)];
    const double b = facing[static_cast<std::size_t>(next)];
    if ((a > 0) != (b > 0)) {
      Eigen::Vector3d end = Eigen::Vector3d::Zero();
      end[k] = b / (b - a);
      end[next] = a / (a - b);
      ends.push_back(end);
    }
  }
  if (ends.size() != 2) {
    return std::nullopt;
  }
  const auto at = [&](const Points& values, const Eigen::Vector3d& barycentric) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      sum += barycentric[k] * values.row(face[k]).transpose();
    }
    return sum;
  };
  ContourMove move;
  move.vertices = face;
  move.barycentric = 0.5 * (ends[0] + ends[1]);
  const Eigen::Vector3d point = at(mesh.vertices, move.barycentric);
  const Eigen::Vector3d normal = at(normals, move.barycentric).normalized();
  const auto pixel = project(view.camera, point);
  const auto jacobian = project_jacobian(view.camera, point);
  const auto first = project(view.camera, at(mesh.vertices, ends[0]));
  const auto last = project(view.camera, at(mesh.vertices, ends[1]));
  if (!pixel || !jacobian || !first || !last) {
    return std::nullopt;
  }
  const Eigen::Vector2d outward = *jacobian * normal;  // px a metre
  const double scale = outward.norm();
  if (!(scale > 0) || !before_background(view.mask, *pixel, outward / scale, options.reach) ||
      any_hit(tree, {point + kOffSurface * normal, centre - point, 0, 1})) {
    return std::nullopt;
  }
  const auto edge = edge_across(view.image, *pixel, outward / scale, options.reach);
  if (!edge) {
    return std::nullopt;
  }
  move.along = *edge / scale;
  move.deviation = options.noise / scale;
  move.count = (*first - *last).norm() / kAlike;
  return move;
}

/// Observations of a surface in all images, in order of views and faces.
std::vector<ContourMove> moves_of(const Mesh& mesh, const Points& normals,
                                  const std::vector<View>& views, const Triangles& faces,
                                  const ContourOptions& options) {
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  std::vector<ContourMove> moves;
  for (const View& view : views) {
    std::vector<std::optional<ContourMove>> found(static_cast<std::size_t>(faces.rows()));
    parallel_for(faces.rows(), 256, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        found[static_cast<std::size_t>(f)] =
            move_of_face(view, tree, mesh, normals, faces.row(f).transpose(), options);
      }
    });
    for (const auto& move : found) {
      if (move) {
        moves.push_back(*move);
      }
    }
  }
  return moves;
}

/// The smooth and small field, [V] m, that goes best with the moves: reweighted least squares.
Eigen::VectorXd smooth_field(const std::vector<ContourMove>& moves,
                             const Eigen::SparseMatrix<double>& prior) {
  Eigen::VectorXd field = Eigen::VectorXd::Zero(prior.rows());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  for (int round = 0; round < kReweighted; ++round) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(prior.rows());
    for (const ContourMove& move : moves) {
      double there = 0;
      for (int k = 0; k < 3; ++k) {
        there += move.barycentric[k] * field[move.vertices[k]];
      }
      const double off = (move.along - there) / (kOutlier * move.deviation);
      const double fall = 1 + off * off;
      const double weight = move.count / (move.deviation * move.deviation * fall * fall);
      for (int k = 0; k < 3; ++k) {
        right[move.vertices[k]] += weight * move.barycentric[k] * move.along;
        for (int l = 0; l < 3; ++l) {
          entries.emplace_back(move.vertices[k], move.vertices[l],
                               weight * move.barycentric[k] * move.barycentric[l]);
        }
      }
    }
    Eigen::SparseMatrix<double> matrix(prior.rows(), prior.rows());
    matrix.setFromTriplets(entries.begin(), entries.end());
    matrix += prior;
    factor.compute(matrix);
    ATELIER_CHECK(factor.info() == Eigen::Success, "a positive definite matrix");
    field = factor.solve(right);
  }
  return field;
}

/// Normals averaged over neighbours; zero where there are none.
Points smoothed_normals(const Points& vertices, const Triangles& faces,
                        const Adjacency& neighbors) {
  Points normals = vertex_normals(vertices, faces);
  for (int round = 0; round < kNormalRounds; ++round) {
    const Points before = normals;
    for (Index v = 0; v < normals.rows(); ++v) {
      for (const int other : neighbors[v]) {
        normals.row(v) += before.row(other);
      }
      const double length = normals.row(v).norm();
      normals.row(v) *= length > 0 ? 1 / length : 0;
    }
  }
  return normals;
}

/// The faces all of whose corners may move.
Triangles movable_faces(const Triangles& faces, const std::vector<std::uint8_t>& movable) {
  std::vector<Index> kept;
  for (Index f = 0; f < faces.rows(); ++f) {
    if (movable[static_cast<std::size_t>(faces(f, 0))] != 0 &&
        movable[static_cast<std::size_t>(faces(f, 1))] != 0 &&
        movable[static_cast<std::size_t>(faces(f, 2))] != 0) {
      kept.push_back(f);
    }
  }
  return faces(kept, Eigen::all);
}

}  // namespace

OptionTable describe(ContourOptions& options) {
  OptionTable table;
  table.add("fit", options.fit,
            "Fitting of skin to its occluding contours in the images. Off: it stays where stereo "
            "has it, inside of limbs that are shiny");
  table.add("reach", options.reach, 3, 50, "px",
            "Maximum distance at which a contour is searched; more than the error of the masks");
  table.add("noise", options.noise, 0.05, 50, "px",
            "Standard deviation of a contour; larger smooths more");
  table.add("spread", options.spread, 1e-4, 0.1, "m",
            "Standard deviation of the systematic error of stereo; smaller moves the surface less "
            "and more smoothly");
  table.add("length", options.length, 0.01, 10, "m",
            "Correlation length of the systematic error of stereo; shorter keeps to stereo where "
            "no contour is near");
  return table;
}

Mesh moved_to_contours(const Mesh& mesh, const std::vector<Camera>& cameras,
                       const std::vector<Image>& images, const std::vector<ByteImage>& masks,
                       const std::vector<std::uint8_t>& movable, const ContourOptions& options) {
  ATELIER_CHECK(images.size() == cameras.size() && masks.size() == cameras.size(),
                "an image and a mask for each camera");
  ATELIER_CHECK(movable.size() == static_cast<std::size_t>(mesh.vertices.rows()),
                "every vertex moves or not");
  std::vector<View> views;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (masks[i].data.empty()) {
      continue;
    }
    ATELIER_CHECK(images[i].width == cameras[i].width && images[i].height == cameras[i].height &&
                      images[i].channels == 3 && masks[i].width == cameras[i].width &&
                      masks[i].height == cameras[i].height,
                  "an image or a mask of another size than its camera's");
    views.push_back({cameras[i], images[i], masks[i]});
  }
  const Triangles faces = movable_faces(mesh.faces, movable);
  if (!options.fit || views.empty() || faces.rows() == 0) {
    return mesh;
  }
  const Adjacency neighbors = vertex_neighbors(topology_of(mesh.faces, mesh.vertices.rows()));
  const Eigen::VectorXd areas = vertex_areas(mesh.vertices, faces);
  // Of a field that is alike over `length` a patch of that size costs one.
  const double spread2 = options.spread * options.spread;
  const double length2 = options.length * options.length;
  Eigen::SparseMatrix<double> prior =
      1 / spread2 * cotangent_laplacian(mesh.vertices, faces, {.skip_degenerate = true});
  const double least = 1e-3 * areas.mean();  // of vertices that stay
  for (Index v = 0; v < areas.size(); ++v) {
    prior.coeffRef(v, v) += (areas[v] + least) / (spread2 * length2);
  }
  Mesh moved = mesh;
  Eigen::VectorXd field = Eigen::VectorXd::Zero(mesh.vertices.rows());
  const Points normals = smoothed_normals(mesh.vertices, mesh.faces, neighbors);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<ContourMove> moves = moves_of(moved, normals, views, faces, options);
    for (ContourMove& move : moves) {  // from where the surface was at first
      for (int k = 0; k < 3; ++k) {
        move.along += move.barycentric[k] * field[move.vertices[k]];
      }
    }
    field = smooth_field(moves, prior);
    moved.vertices = mesh.vertices + Points(field.asDiagonal() * normals);
  }
  if (mesh.normals.rows() > 0) {
    moved.normals = vertex_normals(moved.vertices, moved.faces);
  }
  return moved;
}

}  // namespace atelier
