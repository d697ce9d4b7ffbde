#include "pipeline/garment/register_measures.h"

#include <algorithm>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>

#include "capture/capture_fabric.h"
#include "capture/capture_info.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/saturating_cast.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "registration/tracking/register_garment.h"
#include "registration/tracking/registration_error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Errors of all frames, in millimetres.
struct Errors {
  std::vector<double> points, last;
  double chamfer = 0;
  double frames = 0;
  double inverted = 0;
  double inside = 0;  ///< shares of each frame inside its body, as `register` found them
  double asked = 0;   ///< frames that have one

  void add(const Errors& other) {
    points.insert(points.end(), other.points.begin(), other.points.end());
    last.insert(last.end(), other.last.begin(), other.last.end());
    chamfer += other.chamfer;
    frames += other.frames;
    inverted += other.inverted;
    inside += other.inside;
    asked += other.asked;
  }
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) {
    return 0;
  }
  const auto at = values.begin() +
                  saturating_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// 1 for true vertices that two cameras see; empty where the ground truth does not say.
std::vector<char> seen_twice(const GroundTruthFrame& frame, std::size_t garment) {
  if (garment >= frame.garments_seen.size() || frame.garments_seen[garment].data.empty()) {
    return {};
  }
  const ByteImage& seen = frame.garments_seen[garment];
  std::vector<char> twice(static_cast<std::size_t>(seen.width), 0);
  for (int v = 0; v < seen.width; ++v) {
    int views = 0;
    for (int c = 0; c < seen.height; ++c) {
      views += seen.at(v, c);
    }
    twice[static_cast<std::size_t>(v)] = views >= 2 ? 1 : 0;
  }
  return twice;
}

Errors errors_of(const fs::path& folder, int template_frame, std::size_t garment,
                 const fs::path& capture, const GroundTruth& truth) {
  const Sequence registered = open_sequence(folder);
  const Triangles& true_faces = truth.garments[garment].garment.mesh.faces;
  const Mesh mesh = read_mesh_archive(folder / "template.h5");
  const TrueBinding binding = bind_to_truth(
      mesh.vertices, read_ground_truth_frame(capture, truth, template_frame).garments[garment],
      true_faces);
  const Topology topology = topology_of(registered.faces, mesh.vertices.rows());
  Errors errors;
  for (std::size_t i = 0; i < registered.frame_ids.size(); ++i) {
    const GroundTruthFrame frame_truth =
        read_ground_truth_frame(capture, truth, registered.frame_ids[i]);
    if (frame_truth.garments[garment].rows() == 0) {
      continue;
    }
    const Points vertices = frame(registered, static_cast<Index>(i)).vertices;
    const RegistrationError error =
        registration_error(vertices, registered.faces, binding, frame_truth.garments[garment],
                           true_faces, seen_twice(frame_truth, garment));
    errors.points.insert(errors.points.end(), error.points.begin(), error.points.end());
    errors.last = error.tangential;
    errors.chamfer += (error.to_truth + error.from_truth) / 2;
    errors.frames += 1;
    errors.inverted += static_cast<double>(inverted_faces(topology, vertices).size());
  }
  return errors;
}

void add_measures(std::vector<Measure>& measures, const std::string& prefix, const Errors& errors,
                  bool ground_truth_scans, bool judged) {
  using Side = Measure::Side;
  const Side side = judged ? Side::AtMost : Side::None;
  const auto count = static_cast<double>(errors.points.size());
  const double mean = std::accumulate(errors.points.begin(), errors.points.end(), 0.0);
  const std::string over = "over " + std::to_string(saturating_cast<int>(errors.frames)) +
                           " frames, what two cameras see" +
                           (ground_truth_scans ? ", from ground-truth scans" : "");
  measures.push_back({prefix + "chamfer_mm", 1e3 * errors.chamfer / std::max(errors.frames, 1.0),
                      "mm", ground_truth_scans ? 1.0 : 2.0, side, over});
  measures.push_back({prefix + "point_mean_mm", 1e3 * mean / std::max(count, 1.0), "mm", 3, side,
                      "from where each vertex's material point is"});
  measures.push_back(
      {prefix + "point_p95_mm", 1e3 * quantile(errors.points, 0.95), "mm", 8, side, ""});
  measures.push_back({prefix + "inverted", errors.inverted, "", 0, side,
                      "triangles turned against their neighbours"});
  measures.push_back({prefix + "drift_mm", 1e3 * quantile(errors.last, 0.5), "mm", 2, side,
                      "median error along the surface in the last frame"});
  if (errors.asked > 0) {
    measures.push_back({prefix + "inside_rate", errors.inside / errors.asked, "", 0, Side::None,
                        "of vertices and triangles' centres, inside the estimated body"});
  }
}

/// The share of a garment that is inside the body, frame by frame, of results that say it.
void add_inside(Errors& errors, const JsonPlace& garment) {
  const auto frames = garment.find("frames");
  if (!frames) {
    return;
  }
  for (const auto& [id, unused] : frames->value().items()) {
    if (const auto inside = frames->at(id).find("inside")) {
      errors.inside += inside->number();
      errors.asked += 1;
    }
  }
}

nlohmann::json figures_of(const fs::path& file) {
  constexpr std::size_t kMaxText = 1 << 26;
  return parse_json(read_file_text(file, kMaxText), file.string());
}

}  // namespace

int registered_template_frame(const fs::path& registered, const std::string& name) {
  const fs::path file = registered / "figures.json";
  const nlohmann::json figures = figures_of(file);
  return static_cast<int>(JsonPlace(figures, file.string())
                              .at(name)
                              .at("template_frame")
                              .integer(0, std::numeric_limits<int>::max()));
}

std::vector<Measure> measure_register(const fs::path& workspace, const fs::path& capture) {
  const auto current = current_name(workspace / "register");
  if (!current) {
    return {};
  }
  const fs::path result = workspace / "register" / *current;
  const std::map<std::string, double> metrics = read_manifest(result, "register").metrics;
  const auto metric = metrics.find("ground_truth_scans");
  const bool ground_truth_scans = metric != metrics.end() && metric->second > 0;
  const GroundTruth truth = read_ground_truth(capture);
  const fs::path file = result / "figures.json";
  const nlohmann::json figures = figures_of(file);
  Errors all;
  std::vector<std::pair<std::string, Errors>> each;
  for (const auto& [name, unused] : figures.items()) {
    for (std::size_t g = 0; g < truth.garments.size(); ++g) {
      if (label_name(truth.garments[g].label) == name) {
        const int template_frame = registered_template_frame(result, name);
        each.emplace_back(
            name, errors_of(result / "registered" / name, template_frame, g, capture, truth));
        add_inside(each.back().second, JsonPlace(figures, file.string()).at(name));
        all.add(each.back().second);
      }
    }
  }
  std::vector<Measure> measures;
  if (each.empty()) {
    return measures;
  }
  // No image shows whether points slide along plain cloth.
  add_measures(measures, "register.", all, ground_truth_scans, capture_fabric(capture) != "plain");
  for (const auto& [name, errors] : each) {
    add_measures(measures, "register." + name + ".", errors, ground_truth_scans, false);
  }
  return measures;
}

}  // namespace atelier
