#include "pipeline/garment/template_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/garment_archive.h"
#include "core/intersection.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/template/texture_atlas.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Distances, m, weighted alike.
struct Distances {
  std::vector<double> values;

  void add(const Points& from, const Points& vertices, const Triangles& faces) {
    for (const ClosestPoint& nearest : closest_points(build_tree(vertices, faces), from)) {
      values.push_back(std::sqrt(nearest.squared_distance));
    }
  }
  double mean() const {
    double sum = 0;
    for (const double value : values) {
      sum += value;
    }
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
  }
  double p95() {
    if (values.empty()) {
      return 0;
    }
    std::sort(values.begin(), values.end());
    return values[saturating_cast<std::size_t>(0.95 * static_cast<double>(values.size() - 1))];
  }
};

/// Vertices that two cameras see; all where nothing says who sees them.
Points seen_of(const GroundTruthFrame& frame, std::size_t garment) {
  const Points& all = frame.garments[garment];
  if (garment >= frame.garments_seen.size() || frame.garments_seen[garment].data.empty()) {
    return all;
  }
  const ByteImage& seen = frame.garments_seen[garment];
  Points kept(all.rows(), 3);
  Index count = 0;
  for (Index v = 0; v < all.rows(); ++v) {
    int views = 0;
    for (int c = 0; c < seen.height; ++c) {
      views += seen.at(static_cast<int>(v), c, 0);
    }
    if (views >= 2) {
      kept.row(count++) = all.row(v);
    }
  }
  kept.conservativeResize(count, 3);
  return kept;
}

}  // namespace

std::vector<Measure> measure_template(const fs::path& workspace, const fs::path& capture) {
  const fs::path result = workspace / "template" / "current";
  const fs::path file = result / "template.json";
  if (!fs::exists(file)) {
    return {};
  }
  const nlohmann::json json =
      parse_json(read_file_text(file, Limits().text_file_bytes), file.string());
  const GroundTruth truth = read_ground_truth(capture);
  Distances off;
  Distances missed;
  Distances missed_seen;
  double boundaries = 0;
  double area_ratio = 1;
  double crossing = 0;
  double broken = 0;
  double stretch = 0;
  double garments = 0;
  std::vector<std::string> left(0);
  for (std::size_t g = 0; g < truth.garments.size(); ++g) {
    left.push_back(truth.garments[g].garment.name);
  }
  for (const JsonPlace& one : JsonPlace(json, file.string()).items("garments")) {
    const std::string label = one.text_or("label", "");
    const auto match =
        std::find_if(truth.garments.begin(), truth.garments.end(),
                     [&](const GroundTruthGarment& t) { return label_name(t.label) == label; });
    if (match == truth.garments.end()) {
      continue;
    }
    const auto g = static_cast<std::size_t>(match - truth.garments.begin());
    const GroundTruthFrame frame = read_ground_truth_frame(
        capture, truth,
        static_cast<int>(one.integer_or("frame", 0, 0, std::numeric_limits<int>::max())));
    const Triangles& faces = match->garment.mesh.faces;
    const Garment garment = read_garment_archive(result / "garments" / (label + ".h5"));
    const Mesh& mesh = garment.mesh;
    const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
    garments += 1;
    std::erase(left, match->garment.name);
    off.add(mesh.vertices, frame.garments[g], faces);
    missed.add(frame.garments[g], mesh.vertices, mesh.faces);
    missed_seen.add(seen_of(frame, g), mesh.vertices, mesh.faces);
    const auto loops = boundary_loops(topology_of(faces, frame.garments[g].rows())).size();
    const auto named = static_cast<double>(
        std::count_if(garment.boundary_names.begin(), garment.boundary_names.end(),
                      [](const std::string& name) { return !name.starts_with("opening"); }));
    boundaries += std::abs(static_cast<double>(loops) -
                           static_cast<double>(boundary_loops(topology).size())) +
                  std::max(0.0, static_cast<double>(loops) - named);
    const double ratio =
        face_areas(mesh.vertices, mesh.faces).sum() / face_areas(frame.garments[g], faces).sum();
    area_ratio = std::abs(ratio - 1) > std::abs(area_ratio - 1) ? ratio : area_ratio;
    crossing += static_cast<double>(self_intersections(mesh.vertices, mesh.faces).size());
    broken += is_manifold(manifold_defects(topology)) ? 0 : 1;
    stretch = std::max(stretch, measure_atlas(mesh).stretch_p99);
  }
  using Side = Measure::Side;
  const std::string over = "over " + std::to_string(saturating_cast<int>(garments)) + " garments";
  return {
      {"template.mean_mm", 1e3 * off.mean(), "mm", 0, Side::None,
       "template to the ground-truth cloth of its frame, " + over},
      {"template.p95_mm", 1e3 * off.p95(), "mm", 0, Side::None, "the same"},
      {"template.seen_mean_mm", 1e3 * missed_seen.mean(), "mm", 0, Side::None,
       "ground-truth cloth that two cameras see to the template"},
      {"template.seen_p95_mm", 1e3 * missed_seen.p95(), "mm", 0, Side::None, "the same"},
      {"template.all_mean_mm", 1e3 * missed.mean(), "mm", 0, Side::None,
       "all ground-truth cloth to the template, including what lies under other clothes"},
      {"template.all_p95_mm", 1e3 * missed.p95(), "mm", 0, Side::None, "the same"},
      {"template.boundaries_wrong", boundaries, "", 0, Side::AtMost,
       "openings too many, too few or without a name"},
      {"template.garments_missed", static_cast<double>(left.size()), "", 0, Side::AtMost, ""},
      {"template.area_ratio", area_ratio, "", 0, Side::None,
       "area over the ground truth's, of the worst garment"},
      {"template.self_intersections", crossing, "", 0, Side::None, "pairs of triangles"},
      {"template.not_manifold", broken, "", 0, Side::AtMost, "garments"},
      {"template.atlas_stretch", stretch, "", 0, Side::None, "p99 by area, of the worst garment"},
  };
}

}  // namespace atelier
