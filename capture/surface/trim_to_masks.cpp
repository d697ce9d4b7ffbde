#include "capture/surface/trim_to_masks.h"

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kLeastCosine = 0.27;  // between normal and view; 1.3 rad
constexpr double kOffSurface = 0.003;  // m: the vertex's own faces do not hide it
constexpr int kSmoothRounds = 2;       // of means over neighbours

struct Answers {
  double beside = 0;
  double all = 0;
};

void ask(Answers& answers, const Camera& camera, const ByteImage& mask, const TriangleTree& tree,
         const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d to_camera = camera_center(camera) - point;
  const double cosine = normal.dot(to_camera.normalized());
  if (cosine < kLeastCosine) {
    return;
  }
  const auto pixel = project(camera, point);
  if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width ||
      pixel->y() >= camera.height ||
      any_hit(tree, {point + kOffSurface * normal, to_camera, 0, 1})) {
    return;
  }
  const bool subject = mask.at(static_cast<int>(pixel->x()), static_cast<int>(pixel->y())) != 0;
  answers.beside += subject ? 0 : cosine * cosine;
  answers.all += cosine * cosine;
}

/// Share of the answers, [V], that a vertex lies beside the subject.
Eigen::VectorXd shares_beside(const Mesh& mesh, const std::vector<Camera>& cameras,
                              const std::vector<ByteImage>& masks) {
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  Eigen::VectorXd shares(mesh.vertices.rows());
  parallel_for(mesh.vertices.rows(), 256, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      Answers answers;
      for (std::size_t i = 0; i < cameras.size(); ++i) {
        if (!masks[i].data.empty()) {
          ask(answers, cameras[i], masks[i], tree, mesh.vertices.row(v).transpose(),
              normals.row(v).transpose());
        }
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

/// The mesh of some of its faces, without vertices that these do not use.
Mesh of_faces(const Mesh& mesh, const std::vector<Index>& faces) {
  std::vector<int> place(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  std::vector<int> rows;
  Mesh result;
  result.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.faces(faces[i], k);
      int& at = place[static_cast<std::size_t>(v)];
      if (at < 0) {
        at = static_cast<int>(rows.size());
        rows.push_back(v);
      }
      result.faces(static_cast<Index>(i), k) = at;
    }
  }
  result.vertices = mesh.vertices(rows, Eigen::all);
  if (mesh.normals.rows() > 0) {
    result.normals = mesh.normals(rows, Eigen::all);
  }
  if (mesh.colors.rows() > 0) {
    result.colors = mesh.colors(rows, Eigen::all);
  }
  if (mesh.confidence.size() > 0) {
    result.confidence = mesh.confidence(rows);
  }
  for (std::size_t i = 0; i < rows.size() && !mesh.labels.empty(); ++i) {
    result.labels.push_back(mesh.labels[static_cast<std::size_t>(rows[i])]);
  }
  return result;
}

}  // namespace

Mesh trimmed_to_masks(const Mesh& mesh, const std::vector<Camera>& cameras,
                      const std::vector<ByteImage>& masks) {
  ATELIER_CHECK(masks.size() == cameras.size(), "a mask for each camera");
  for (std::size_t i = 0; i < masks.size(); ++i) {
    ATELIER_CHECK(masks[i].data.empty() ||
                      (masks[i].width == cameras[i].width && masks[i].height == cameras[i].height),
                  "a mask of another size than its camera's");
  }
  if (mesh.faces.rows() == 0) {
    return mesh;
  }
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const Eigen::VectorXd shares =
      smoothed(shares_beside(mesh, cameras, masks), vertex_neighbors(topology));
  std::vector<Index> kept;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const double share =
        (shares[mesh.faces(f, 0)] + shares[mesh.faces(f, 1)] + shares[mesh.faces(f, 2)]) / 3;
    if (share <= 0.5) {
      kept.push_back(f);
    }
  }
  return of_faces(mesh, kept);
}

}  // namespace atelier
