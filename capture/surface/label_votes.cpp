#include <algorithm>
#include <array>
#include <cmath>

#include "capture/surface/surface_labels.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr std::uint8_t kBackground = 0;
constexpr std::uint8_t kUnknown = 255;
constexpr double kNearBorder = 0.25;  // weight of a pixel near another label
constexpr double kUnsure = 0.25;      // of a view whose depth does not confirm the place
constexpr double kDepthError = 0.02;  // relative, up to which it does

/// One vertex's answer from one view.
struct Vote {
  std::uint8_t label = kUnknown;
  float weight = 0;
};

bool near_border(const ByteImage& labels, int x, int y, int radius) {
  const std::uint8_t own = labels.at(x, y);
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const int qx = std::clamp(x + dx, 0, labels.width - 1);
      const int qy = std::clamp(y + dy, 0, labels.height - 1);
      if (labels.at(qx, qy) != own) {
        return true;
      }
    }
  }
  return false;
}

/// How sure the view is that the surface is at the point, which lies in its pixel (x, y).
double sureness(const LabelView& view, const Eigen::Vector3d& point, int x, int y) {
  if (view.depth == nullptr) {
    return 1;
  }
  const double found = view.depth->depth.at(x, y);
  const double depth = camera_from_world(view.camera, point).z();
  return std::abs(found - depth) <= kDepthError * depth
             ? kUnsure + (1 - kUnsure) * view.depth->confidence.at(x, y)
             : kUnsure;
}

Vote vote_of(const LabelView& view, const TriangleTree& tree, const Eigen::Vector3d& point,
             const Eigen::Vector3d& normal, const SurfaceLabelOptions& options) {
  const Eigen::Vector3d to_camera = camera_center(view.camera) - point;
  const double cosine = normal.dot(to_camera.normalized());
  if (cosine < std::cos(options.max_view_angle)) {
    return {};
  }
  const auto pixel = project(view.camera, point);
  if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= view.camera.width ||
      pixel->y() >= view.camera.height) {
    return {};
  }
  const int x = static_cast<int>(pixel->x());
  const int y = static_cast<int>(pixel->y());
  const std::uint8_t label = view.labels.at(x, y);
  if (label == kBackground || label == kUnknown) {
    return {};
  }
  constexpr double kOffSurface = 0.003;  // m: the vertex's own faces do not hide it
  if (any_hit(tree, {point + kOffSurface * normal, to_camera, 0, 1})) {
    return {};
  }
  const bool border = near_border(view.labels, x, y, static_cast<int>(options.border));
  return {label, static_cast<float>(cosine * cosine * sureness(view, point, x, y) *
                                    (border ? kNearBorder : 1))};
}

}  // namespace

OptionTable describe(SurfaceLabelOptions& options) {
  OptionTable table;
  table.add("border", options.border, 0, 100, "px",
            "Distance to another label in the image below which a pixel's vote is down-weighted");
  table.add("max_view_angle", options.max_view_angle, 0, 1.57, "rad",
            "Maximum angle between surface normal and view direction at which a view votes");
  table.add(
      "smoothness", options.smoothness, 0, 1000, "",
      "Cost of a label border between neighbours relative to a vote; higher for smoother borders");
  table.add("rounds", options.rounds, 1, 100, "",
            "Number of rounds in which views that disagree with the others are down-weighted");
  return table;
}

LabelVotes label_votes(const Mesh& mesh, const std::vector<LabelView>& views,
                       const SurfaceLabelOptions& options) {
  for (const LabelView& view : views) {
    ATELIER_CHECK(view.labels.width == view.camera.width &&
                      view.labels.height == view.camera.height && view.labels.channels == 1,
                  "labels of another size than their camera's");
    ATELIER_CHECK(view.depth == nullptr || (view.depth->depth.width == view.labels.width &&
                                            view.depth->depth.height == view.labels.height),
                  "labels of another size than their view's depth");
  }
  const auto n = static_cast<std::size_t>(mesh.vertices.rows());
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  std::vector<std::vector<Vote>> votes(views.size(), std::vector<Vote>(n));
  for (std::size_t i = 0; i < views.size(); ++i) {
    parallel_for(mesh.vertices.rows(), 256, [&](Index begin, Index end) {
      for (Index v = begin; v < end; ++v) {
        votes[i][static_cast<std::size_t>(v)] = vote_of(
            views[i], tree, mesh.vertices.row(v).transpose(), normals.row(v).transpose(), options);
      }
    });
  }
  std::array<bool, 256> occurs{};
  for (const auto& of_view : votes) {
    for (const Vote& vote : of_view) {
      occurs[vote.label] = occurs[vote.label] || vote.weight > 0;
    }
  }
  LabelVotes result;
  std::array<Index, 256> column{};
  for (int id = 0; id < 255; ++id) {
    if (occurs[static_cast<std::size_t>(id)]) {
      column[static_cast<std::size_t>(id)] = static_cast<Index>(result.ids.size());
      result.ids.push_back(static_cast<std::uint8_t>(id));
    }
  }
  result.trust.assign(views.size(), 1);
  const auto labels = static_cast<Index>(result.ids.size());
  for (int round = 0; round < options.rounds && labels > 0; ++round) {
    result.probability = Eigen::MatrixXd::Constant(mesh.vertices.rows(), labels, 1e-3);
    for (std::size_t i = 0; i < views.size(); ++i) {
      for (std::size_t v = 0; v < n; ++v) {
        if (votes[i][v].weight > 0) {
          result.probability(static_cast<Index>(v), column[votes[i][v].label]) +=
              result.trust[i] * votes[i][v].weight;
        }
      }
    }
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      result.probability.row(v) /= result.probability.row(v).sum();
    }
    // A view is trusted as far as it agrees with what all say together; squared, so that a view
    // that is wrong as a whole falls away quickly.
    for (std::size_t i = 0; i < views.size(); ++i) {
      double agreed = 0;
      double total = 0;
      for (std::size_t v = 0; v < n; ++v) {
        if (votes[i][v].weight > 0) {
          agreed += votes[i][v].weight *
                    result.probability(static_cast<Index>(v), column[votes[i][v].label]);
          total += votes[i][v].weight;
        }
      }
      result.trust[i] = total > 0 ? (agreed / total) * (agreed / total) : 0;
    }
  }
  return result;
}

}  // namespace atelier
