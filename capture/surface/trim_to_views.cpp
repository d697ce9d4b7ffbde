#include "capture/surface/trim_to_views.h"

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/part_of_mesh.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kMinCosine = 0.27;        // between normal and view; 1.3 rad
constexpr double kTrimOffSurface = 0.003;  // m: the vertex's own faces do not hide it
constexpr double kBehind = 0.02;           // m: a view's depth that is not this surface's
constexpr int kSmoothRounds = 1;           // of means over neighbours

/// One view's evidence of where the subject is.
struct TrimView {
  const Camera& camera;
  const ByteImage& mask;  // empty: not known
  const DepthMap* map;    // or null
  double min_confidence;
};

struct Answers {
  double beside = 0;
  double all = 0;
};

/// True where the view looks past a place: by its mask there is nobody, or what it sees there lies
/// well behind.
bool looks_past(const TrimView& view, const Eigen::Vector3d& point, int x, int y) {
  if (!view.mask.data.empty() && view.mask.at(x, y) == 0) {
    return true;
  }
  return view.map != nullptr && view.map->confidence.at(x, y) >= view.min_confidence &&
         view.map->depth.at(x, y) > camera_from_world(view.camera, point).z() + kBehind;
}

void ask(Answers& answers, const TrimView& view, const TriangleTree& tree,
         const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d to_camera = camera_center(view.camera) - point;
  const double cosine = normal.dot(to_camera.normalized());
  if (cosine < kMinCosine) {
    return;
  }
  const auto pixel = project(view.camera, point);
  if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= view.camera.width ||
      pixel->y() >= view.camera.height ||
      any_hit(tree, {point + kTrimOffSurface * normal, to_camera, 0, 1})) {
    return;
  }
  const bool past =
      looks_past(view, point, static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
  answers.beside += past ? cosine * cosine : 0;
  answers.all += cosine * cosine;
}

/// Share of the answers, [V], that a vertex lies beside the subject.
Eigen::VectorXd shares_beside(const Mesh& mesh, const std::vector<TrimView>& views) {
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  Eigen::VectorXd shares(mesh.vertices.rows());
  parallel_for(mesh.vertices.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      Answers answers;
      for (const TrimView& view : views) {
        ask(answers, view, tree, mesh.vertices.row(v).transpose(), normals.row(v).transpose());
      }
      shares[v] = answers.all > 0 ? answers.beside / answers.all : 0;
    }
  });
  return shares;
}

Eigen::VectorXd smoothed(Eigen::VectorXd values, const Adjacency& neighbors) {
  for (int round = 0; round < kSmoothRounds; ++round) {
    const Eigen::VectorXd before = values;
    for (Index v = 0; v < values.size(); ++v) {
      double sum = before[v];
      for (const int other : neighbors[v]) {
        sum += before[other];
      }
      values[v] = sum / static_cast<double>(neighbors[v].size() + 1);
    }
  }
  return values;
}

}  // namespace

Mesh trimmed_to_views(const Mesh& mesh, const std::vector<Camera>& cameras,
                      const std::vector<ByteImage>& masks, const std::vector<DepthMap>& maps,
                      double min_confidence) {
  ATELIER_CHECK(masks.size() == cameras.size(), "a mask for each camera");
  ATELIER_CHECK(maps.empty() || maps.size() == cameras.size(), "a depth map for each camera");
  std::vector<TrimView> views;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto fits = [&](int width, int height) {
      return width == cameras[i].width && height == cameras[i].height;
    };
    const bool has_mask = !masks[i].data.empty();
    const bool has_map = !maps.empty() && !maps[i].depth.data.empty();
    ATELIER_CHECK(!has_mask || fits(masks[i].width, masks[i].height),
                  "a mask of another size than its camera's");
    ATELIER_CHECK(!has_map || fits(maps[i].depth.width, maps[i].depth.height),
                  "a depth map of another size than its camera's");
    if (has_mask || has_map) {
      views.push_back({cameras[i], masks[i], has_map ? &maps[i] : nullptr, min_confidence});
    }
  }
  if (mesh.faces.rows() == 0) {
    return mesh;
  }
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const Eigen::VectorXd shares = smoothed(shares_beside(mesh, views), vertex_neighbors(topology));
  std::vector<Index> kept;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const double share =
        (shares[mesh.faces(f, 0)] + shares[mesh.faces(f, 1)] + shares[mesh.faces(f, 2)]) / 3;
    if (share <= 0.5) {
      kept.push_back(f);
    }
  }
  return part_of_mesh(mesh, kept);
}

}  // namespace atelier
