#include "pipeline/person/body_measures.h"

#include <string>

#include "bodymodel/underlying/body_error.h"
#include "capture/capture_info.h"
#include "core/io/ground_truth_archive.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Sums over frames, and by how much they count.
struct Sums {
  double frames = 0;
  double mean = 0, covered_mean = 0;
  double vertex_mean = 0, vertex_covered_mean = 0;
  bool same_topology = true;
  double covered = 0, outside = 0, depth = 0;
  double close = 0, proximity = 0, bias = 0;
};

void add(Sums& sums, const BodyError& error) {
  sums.frames += 1;
  sums.mean += error.mean;
  sums.covered_mean += error.covered_mean;
  sums.vertex_mean += error.vertex_mean;
  sums.vertex_covered_mean += error.vertex_covered_mean;
  sums.same_topology = sums.same_topology && error.vertex_mean >= 0;
  const auto covered = static_cast<double>(error.covered);
  const auto close = static_cast<double>(error.close);
  sums.covered += covered;
  sums.outside += covered * error.outside_rate;
  sums.depth += covered * error.outside_rate * error.outside_depth;
  sums.close += close;
  sums.proximity += close * error.proximity;
  sums.bias += close * error.proximity_bias;
}

std::vector<Measure> measures_of(const Sums& sums, const std::string& stage,
                                 bool ground_truth_scans) {
  using Side = Measure::Side;
  const auto over = [](double sum, double count) { return count > 0 ? sum / count : 0; };
  const auto target = [&](double from_scans, double from_truth) {
    return ground_truth_scans ? from_truth : from_scans;
  };
  const std::string frames = "mean over " + std::to_string(static_cast<int>(sums.frames)) +
                             (ground_truth_scans ? " frames, from ground-truth scans" : " frames");
  std::vector<Measure> measures = {
      {stage + ".mean_mm", 1e3 * over(sums.mean, sums.frames), "mm", target(5, 3), Side::AtMost,
       "distance from the ground-truth body, " + frames},
      {stage + ".covered_mean_mm", 1e3 * over(sums.covered_mean, sums.frames), "mm", target(8, 6),
       Side::AtMost, "of what is under clothes"},
  };
  if (sums.same_topology) {
    measures.push_back({stage + ".vertex_mean_mm", 1e3 * over(sums.vertex_mean, sums.frames), "mm",
                        0, Side::None, "distance of each vertex from itself"});
    measures.push_back({stage + ".vertex_covered_mean_mm",
                        1e3 * over(sums.vertex_covered_mean, sums.frames), "mm", 0, Side::None,
                        "of those under clothes"});
  }
  measures.push_back({stage + ".outside_rate", over(sums.outside, sums.covered), "",
                      target(0.03, 0.01), Side::AtMost,
                      "share of the covered skin more than 1 mm outside the ground-truth clothes"});
  measures.push_back({stage + ".outside_depth_mm", 1e3 * over(sums.depth, sums.outside), "mm",
                      target(1, 0.5), Side::AtMost, "mean depth of those"});
  measures.push_back({stage + ".proximity_mm", 1e3 * over(sums.proximity, sums.close), "mm", 1.5,
                      Side::AtMost,
                      "mean error of the gap where the ground truth has less than 1 cm"});
  measures.push_back({stage + ".proximity_bias_mm", 1e3 * over(sums.bias, sums.close), "mm", 0,
                      Side::None, "its mean; above 0: the body is too thin"});
  return measures;
}

std::vector<Measure> measure_bodies(const fs::path& workspace, const fs::path& capture,
                                    const std::string& stage) {
  const auto current = current_name(workspace / stage);
  if (!current) {
    return {};
  }
  const fs::path result = workspace / stage / *current;
  const std::map<std::string, double> metrics = read_manifest(result, stage).metrics;
  const auto ground_truth_scans = metrics.find("ground_truth_scans");
  const GroundTruth truth = read_ground_truth(capture);
  const Sequence bodies = open_sequence(result);
  Sums sums;
  for (std::size_t i = 0; i < bodies.frame_ids.size(); ++i) {
    const GroundTruthFrame true_frame =
        read_ground_truth_frame(capture, truth, bodies.frame_ids[i]);
    std::vector<Mesh> garments;
    for (std::size_t g = 0; g < true_frame.garments.size(); ++g) {
      if (true_frame.garments[g].rows() > 0) {
        Mesh garment;
        garment.vertices = true_frame.garments[g];
        garment.faces = truth.garments[g].garment.mesh.faces;
        garments.push_back(std::move(garment));
      }
    }
    if (garments.empty()) {
      continue;
    }
    Mesh body;
    body.vertices = true_frame.body;
    body.faces = truth.body.faces;
    add(sums,
        body_error(bodies.faces, frame(bodies, static_cast<Index>(i)).vertices, body, garments));
  }
  return sums.frames > 0
             ? measures_of(sums, stage,
                           ground_truth_scans != metrics.end() && ground_truth_scans->second > 0)
             : std::vector<Measure>{};
}

}  // namespace

std::vector<Measure> measure_body(const fs::path& workspace, const fs::path& capture) {
  return measure_bodies(workspace, capture, "body");
}

std::vector<Measure> measure_refine(const fs::path& workspace, const fs::path& capture) {
  return measure_bodies(workspace, capture, "refine");
}

}  // namespace atelier
