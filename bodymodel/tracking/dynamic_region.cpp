#include "bodymodel/tracking/dynamic_region.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

constexpr double kPatch = 0.05;   // m
constexpr double kNear = 0.1;     // m, neighbours that vote
constexpr double kFewPoints = 2;  // of a frame that say where clothing is

/// Patches of vertices: centres picked greedily in order of the vertices, every vertex to the
/// nearest centre.
struct Patches {
  std::vector<int> of_vertex;
  Points centres;
};

Patches patches_of(const Points& vertices) {
  std::vector<Eigen::RowVector3d> centres;
  for (Index v = 0; v < vertices.rows(); ++v) {
    const bool taken = std::any_of(centres.begin(), centres.end(), [&](const auto& centre) {
      return (centre - vertices.row(v)).squaredNorm() < kPatch * kPatch;
    });
    if (!taken) {
      centres.push_back(vertices.row(v));
    }
  }
  Patches patches;
  patches.centres.resize(static_cast<Index>(centres.size()), 3);
  for (std::size_t c = 0; c < centres.size(); ++c) {
    patches.centres.row(static_cast<Index>(c)) = centres[c];
  }
  for (Index v = 0; v < vertices.rows(); ++v) {
    Index best = 0;
    (patches.centres.rowwise() - vertices.row(v)).rowwise().squaredNorm().minCoeff(&best);
    patches.of_vertex.push_back(static_cast<int>(best));
  }
  return patches;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

OptionTable describe(DynamicOptions& options) {
  OptionTable table;
  table.add("swing", options.swing, 1e-3, 1, "m",
            "Minimum spread over time of the gap to the body at which clothing is left out; larger "
            "keeps looser clothing");
  table.add("gap", options.gap, 1e-3, 1, "m",
            "Median gap above which clothing is left out in any case");
  table.add("min_frames", options.min_frames, 2, 1000, "",
            "Minimum number of frames that must see a patch for its swing to count");
  return table;
}

ClothGaps cloth_gaps(const FittedPerson& person, const BodySurface& surface, const ScanPoints& scan,
                     double reach) {
  ClothGaps gaps{Eigen::VectorXd::Zero(surface.vertices.rows()),
                 Eigen::VectorXd::Zero(surface.vertices.rows())};
  for (Index i = 0; i < scan.points.rows(); ++i) {
    if (scan.parts[static_cast<std::size_t>(i)] != ScanPart::Cloth) {
      continue;
    }
    const ClosestPoint near = closest_point(surface.tree, scan.points.row(i).transpose(), reach);
    if (near.face < 0) {
      continue;
    }
    Index heaviest = 0;
    near.barycentric.maxCoeff(&heaviest);
    const int vertex = person.model->mesh.faces(near.face, heaviest);
    gaps.sum[vertex] += std::sqrt(near.squared_distance);
    gaps.count[vertex] += 1;
  }
  return gaps;
}

std::vector<char> dynamic_region(const FittedPerson& person, const std::vector<ClothGaps>& frames,
                                 const DynamicOptions& options) {
  const Points& vertices = person.shaped.vertices;
  const Patches patches = patches_of(vertices);
  const Index count = patches.centres.rows();
  std::vector<std::vector<double>> gaps(static_cast<std::size_t>(count));
  bool any = false;
  for (const ClothGaps& frame : frames) {
    ATELIER_CHECK(frame.sum.size() == vertices.rows() && frame.count.size() == vertices.rows(),
                  "gaps of another body");
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
    Eigen::VectorXd points = Eigen::VectorXd::Zero(count);
    for (Index v = 0; v < vertices.rows(); ++v) {
      const int patch = patches.of_vertex[static_cast<std::size_t>(v)];
      sum[patch] += frame.sum[v];
      points[patch] += frame.count[v];
    }
    for (Index p = 0; p < count; ++p) {
      if (points[p] >= kFewPoints) {
        gaps[static_cast<std::size_t>(p)].push_back(sum[p] / points[p]);
        any = true;
      }
    }
  }
  if (!any) {
    return {};
  }
  // 1 dynamic, 0 still, -1 without clothing.
  std::vector<int> state(static_cast<std::size_t>(count), -1);
  for (std::size_t p = 0; p < state.size(); ++p) {
    const std::vector<double>& g = gaps[p];
    if (g.empty()) {
      continue;
    }
    double mean = 0;
    double squares = 0;
    for (const double gap : g) {
      mean += gap / static_cast<double>(g.size());
      squares += gap * gap / static_cast<double>(g.size());
    }
    const double spread = std::sqrt(std::max(0.0, squares - mean * mean));
    const bool swings = static_cast<int>(g.size()) >= options.min_frames && spread > options.swing;
    state[p] = swings || median(g) > options.gap ? 1 : 0;
  }
  std::vector<char> dynamic(state.size(), 0);
  for (std::size_t p = 0; p < state.size(); ++p) {
    int votes = 0;
    int voters = 0;
    for (std::size_t q = 0; q < state.size(); ++q) {
      const double far =
          (patches.centres.row(static_cast<Index>(p)) - patches.centres.row(static_cast<Index>(q)))
              .norm();
      if (state[q] >= 0 && far < kNear) {
        votes += state[q];
        ++voters;
      }
    }
    dynamic[p] = voters > 0 && 2 * votes > voters ? 1 : 0;
  }
  std::vector<char> region(static_cast<std::size_t>(vertices.rows()), 0);
  for (std::size_t v = 0; v < region.size(); ++v) {
    region[v] = dynamic[static_cast<std::size_t>(patches.of_vertex[v])];
  }
  return region;
}

}  // namespace atelier
