#include "capture/ground_truth_scan.h"

#include <array>
#include <vector>

#include "capture/label_taxonomy.h"

namespace atelier {
namespace {

/// The mesh joined so far; vertices that no face needs are left out.
struct Joined {
  std::vector<Eigen::RowVector3d> vertices;
  std::vector<std::array<int, 3>> faces;
  std::vector<std::uint8_t> labels;
};

/// Vertices that two cameras see; all of them where nothing says who sees them.
std::vector<char> seen_twice(const ByteImage& seen, Index count) {
  std::vector<char> twice(static_cast<std::size_t>(count), seen.data.empty() ? 1 : 0);
  if (seen.data.empty()) {
    return twice;
  }
  for (std::size_t v = 0; v < twice.size(); ++v) {
    int views = 0;
    for (int c = 0; c < seen.height; ++c) {
      views += seen.data[static_cast<std::size_t>(c) * static_cast<std::size_t>(seen.width) + v];
    }
    twice[v] = views >= 2 ? 1 : 0;
  }
  return twice;
}

void join(Joined& all, const Points& vertices, const Triangles& faces, const ByteImage& seen,
          Label label) {
  if (vertices.rows() == 0) {
    return;
  }
  const std::vector<char> twice = seen_twice(seen, vertices.rows());
  std::vector<int> to(twice.size(), -1);
  for (Index f = 0; f < faces.rows(); ++f) {
    bool kept = true;
    for (int k = 0; k < 3; ++k) {
      kept = kept && twice[static_cast<std::size_t>(faces(f, k))] != 0;
    }
    if (!kept) {
      continue;
    }
    std::array<int, 3> face{};
    for (std::size_t k = 0; k < 3; ++k) {
      const int v = faces(f, static_cast<Index>(k));
      int& index = to[static_cast<std::size_t>(v)];
      if (index < 0) {
        index = static_cast<int>(all.vertices.size());
        all.vertices.emplace_back(vertices.row(v));
        all.labels.push_back(static_cast<std::uint8_t>(label));
      }
      face[k] = index;
    }
    all.faces.push_back(face);
  }
}

}  // namespace

Mesh ground_truth_scan(const GroundTruth& truth, const GroundTruthFrame& frame) {
  Joined all;
  const ByteImage unknown;
  join(all, frame.body, truth.body.faces, frame.body_seen, Label::Skin);
  for (std::size_t i = 0; i < frame.layers.size(); ++i) {
    join(all, frame.layers[i], truth.layers[i].faces, unknown,
         truth.layer_names[i] == "hair"    ? Label::Hair
         : truth.layer_names[i] == "shoes" ? Label::Shoes
                                           : Label::Other);
  }
  for (std::size_t i = 0; i < frame.garments.size(); ++i) {
    join(all, frame.garments[i], truth.garments[i].garment.mesh.faces,
         i < frame.garments_seen.size() ? frame.garments_seen[i] : unknown,
         truth.garments[i].label);
  }
  Mesh scan;
  scan.vertices.resize(static_cast<Index>(all.vertices.size()), 3);
  for (std::size_t v = 0; v < all.vertices.size(); ++v) {
    scan.vertices.row(static_cast<Index>(v)) = all.vertices[v];
  }
  scan.faces.resize(static_cast<Index>(all.faces.size()), 3);
  for (std::size_t f = 0; f < all.faces.size(); ++f) {
    scan.faces.row(static_cast<Index>(f)) << all.faces[f][0], all.faces[f][1], all.faces[f][2];
  }
  scan.labels = std::move(all.labels);
  return scan;
}

}  // namespace atelier
