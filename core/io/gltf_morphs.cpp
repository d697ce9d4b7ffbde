#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/io/mesh_gltf.h"
#include "core/io/text_writer.h"
#include "core/normals.h"

namespace atelier {
namespace {

constexpr double kGoodShape = 1e-4;  // m: fewer shapes where all vertices are as near as this

/// Frames beside the first, less the first, a row each.
Eigen::MatrixXd differences(const std::vector<Points>& frames) {
  const Index size = frames.front().size();
  Eigen::MatrixXd rows(std::ssize(frames) - 1, size);
  for (std::size_t f = 1; f < frames.size(); ++f) {
    rows.row(static_cast<Index>(f) - 1) =
        (frames[f] - frames.front()).reshaped<Eigen::RowMajor>().transpose();
  }
  return rows;
}

Points points_of_row(const Eigen::MatrixXd& rows, Index row) {
  return rows.row(row).reshaped<Eigen::RowMajor>(rows.cols() / 3, 3);
}

/// Largest length of the vectors that rows are made of.
double longest(const Eigen::MatrixXd& rows) {
  double most = 0;
  for (Index i = 0; i < rows.rows(); ++i) {
    most = std::max(most, points_of_row(rows, i).rowwise().norm().maxCoeff());
  }
  return most;
}

GltfMorphs target_a_frame(const std::vector<Points>& positions,
                          const std::vector<Points>& normals) {
  GltfMorphs morphs;
  const auto count = std::ssize(positions);
  morphs.weights = Eigen::MatrixXd::Zero(count, count - 1);
  for (Index f = 1; f < count; ++f) {
    const auto i = static_cast<std::size_t>(f);
    morphs.weights(f, f - 1) = 1;
    morphs.targets.push_back({positions[i] - positions.front(),
                              normals.empty() ? Points() : normals[i] - normals.front()});
    morphs.names.push_back("frame " + std::to_string(f));
  }
  return morphs;
}

}  // namespace

GltfMorphs gltf_morphs(const std::vector<Points>& positions, const std::vector<Points>& normals,
                       int most_targets) {
  ATELIER_CHECK(!positions.empty() && most_targets > 0, "morph targets need frames");
  ATELIER_CHECK(normals.empty() || normals.size() == positions.size(),
                "normals of every frame, or of none");
  if (std::ssize(positions) - 1 <= most_targets) {
    return target_a_frame(positions, normals);
  }
  Eigen::MatrixXd rest = differences(positions);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(rest * rest.transpose());
  const Eigen::MatrixXd turned =
      normals.empty() ? Eigen::MatrixXd(rest.rows(), 0) : differences(normals);
  GltfMorphs morphs;
  morphs.weights = Eigen::MatrixXd::Zero(rest.rows() + 1, most_targets);
  Index count = 0;
  morphs.error = longest(rest);
  while (count < most_targets && morphs.error > kGoodShape) {
    Eigen::VectorXd weights = solver.eigenvectors().col(rest.rows() - 1 - count);
    const double largest = weights.cwiseAbs().maxCoeff();
    // The least-squares shape of these weights; then weights of at most 1.
    const Eigen::MatrixXd shape = weights.transpose() * rest;
    rest -= weights * shape;
    GltfMorphTarget target;
    target.positions = points_of_row(shape * largest, 0);
    if (!normals.empty()) {
      target.normals = points_of_row(largest * (weights.transpose() * turned), 0);
    }
    morphs.targets.push_back(std::move(target));
    morphs.weights.col(count).tail(rest.rows()) = weights / largest;
    ++count;
    morphs.names.push_back("shape " + std::to_string(count));
    morphs.error = longest(rest);
  }
  morphs.weights.conservativeResize(Eigen::NoChange, count);
  return morphs;
}

void add_gltf_morphs(GltfScene& scene, int node, GltfMorphs morphs, double fps) {
  GltfMesh& mesh = scene.meshes.at(
      static_cast<std::size_t>(scene.nodes.at(static_cast<std::size_t>(node)).mesh));
  if (morphs.targets.empty()) {
    return;
  }
  if (morphs.error > 0) {
    scene.findings.push_back(
        {Severity::Note, "gltf-shapes", mesh.name,
         std::to_string(morphs.weights.rows()) + " frames as sums of " +
             std::to_string(morphs.targets.size()) + " shapes, at most " +
             number_text(std::ceil(1e4 * morphs.error) / 10) + " mm off",
         "programs slow down with a shape for each frame; other formats keep every frame"});
  }
  GltfChannel channel;
  channel.node = node;
  channel.path = GltfPath::Weights;
  for (Index f = 0; f < morphs.weights.rows(); ++f) {
    channel.times.push_back(static_cast<double>(f) / fps);
  }
  mesh.weights.assign(morphs.targets.size(), 0.0);
  mesh.target_names = std::move(morphs.names);
  mesh.primitives.at(0).targets = std::move(morphs.targets);
  channel.values = std::move(morphs.weights);
  if (scene.animations.empty()) {
    scene.animations.push_back({.name = mesh.name, .channels = {}});
  }
  scene.animations.front().channels.push_back(std::move(channel));
}

GltfScene gltf_morph_sequence(const std::vector<Mesh>& frames, double fps,
                              const std::string& name) {
  ATELIER_CHECK(!frames.empty(), "a sequence without frames");
  ATELIER_CHECK(fps > 0 && std::isfinite(fps), "fps must be positive");
  const Mesh& first = frames.front();
  std::vector<Points> positions;
  std::vector<Points> normals;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const Mesh& frame = frames[f];
    ATELIER_CHECK(
        equal_arrays(frame.faces, first.faces) && frame.vertices.rows() == first.vertices.rows(),
        "frame " + std::to_string(f) + " has another topology");
    positions.push_back(frame.vertices);
    normals.push_back(frame.normals.rows() == frame.vertices.rows()
                          ? frame.normals
                          : vertex_normals(frame.vertices, frame.faces));
  }
  GltfScene scene = gltf_scene(first, name);
  scene.meshes[0].primitives[0].mesh.normals = normals.front();
  add_gltf_morphs(scene, 0, gltf_morphs(positions, normals), fps);
  return scene;
}

}  // namespace atelier
