#include "pipeline/animation/animate_measures.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "core/io/ground_truth_archive.h"
#include "core/saturating_cast.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "registration/tracking/registered_outfit.h"
#include "registration/tracking/registration_error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> current_result(const fs::path& workspace, const char* stage) {
  const auto current = current_name(workspace / stage);
  return current ? std::optional(workspace / stage / *current) : std::nullopt;
}

/// The true garment of a label, or null.
const GroundTruthGarment* true_garment(const GroundTruth& truth, const std::string& label) {
  const auto found = std::find_if(
      truth.garments.begin(), truth.garments.end(),
      [&](const GroundTruthGarment& garment) { return label_name(garment.label) == label; });
  return found == truth.garments.end() ? nullptr : &*found;
}

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() +
                  saturating_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Errors of one garment in every frame that the ground truth has, m.
std::vector<double> errors_of(const RegisteredGarmentSequence& garment, const fs::path& animated,
                              std::size_t which, const fs::path& capture,
                              const GroundTruth& truth) {
  const Sequence played = open_sequence(animated);
  const Triangles& true_faces = truth.garments[which].garment.mesh.faces;
  const TrueBinding binding = bind_to_truth(
      garment.garment.mesh.vertices,
      read_ground_truth_frame(capture, truth, garment.template_frame).garments[which], true_faces);
  std::vector<double> errors;
  for (std::size_t i = 0; i < played.frame_ids.size(); ++i) {
    const GroundTruthFrame there = read_ground_truth_frame(capture, truth, played.frame_ids[i]);
    if (there.garments[which].rows() == 0) {
      continue;
    }
    const RegistrationError error =
        registration_error(frame(played, static_cast<Index>(i)).vertices, played.faces, binding,
                           there.garments[which], true_faces, {});
    errors.insert(errors.end(), error.points.begin(), error.points.end());
  }
  return errors;
}

void add_errors(std::vector<Measure>& measures, const std::string& prefix,
                const std::vector<double>& errors) {
  if (errors.empty()) {
    return;
  }
  const double mean =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  measures.push_back({prefix + "point_mean_mm", 1e3 * mean, "mm", 0, Measure::Side::None,
                      "simulated in the capture's own motion, from where each vertex's material "
                      "point is"});
  measures.push_back(
      {prefix + "point_p95_mm", 1e3 * quantile(errors, 0.95), "mm", 0, Measure::Side::None, ""});
}

}  // namespace

std::vector<Measure> measure_animate(const fs::path& workspace, const fs::path& capture) {
  const auto result = current_result(workspace, "animate");
  const auto templates = current_result(workspace, "template");
  const auto registered = current_result(workspace, "register");
  if (!result || !templates || !registered) {
    return {};
  }
  if (!read_manifest(*result, "animate").metrics.contains("registered_distance")) {
    return {};
  }
  const GroundTruth truth = read_ground_truth(capture);
  std::vector<Measure> each;
  std::vector<double> all;
  for (const RegisteredGarmentSequence& garment : read_registered_outfit(*templates, *registered)) {
    const GroundTruthGarment* real = true_garment(truth, garment.name);
    const fs::path animated = *result / "garments" / garment.name;
    if (real == nullptr || !fs::exists(animated / "sequence.h5")) {
      continue;
    }
    const std::vector<double> errors = errors_of(
        garment, animated, static_cast<std::size_t>(real - truth.garments.data()), capture, truth);
    add_errors(each, "animate." + garment.name + ".", errors);
    all.insert(all.end(), errors.begin(), errors.end());
  }
  std::vector<Measure> measures;
  add_errors(measures, "animate.", all);
  measures.insert(measures.end(), each.begin(), each.end());
  return measures;
}

}  // namespace atelier
