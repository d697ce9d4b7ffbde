#include "pipeline/evaluation/targets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/io/cameras_file.h"
#include "core/store/result.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kNoGroundTruth = "no frame has both a result and ground truth";
constexpr const char* kNotDynamic =
    "a tenth of the body's vertices or less lie under ground-truth clothing that swings "
    "(track.dynamic_share), so that there is little to leave out";
constexpr const char* kNoLabel =
    "a tenth of the body's vertices or less lie under ground-truth clothing that swings "
    "(track.dynamic_share), or no ground-truth garment has a label of --input.excluded";
constexpr const char* kNoSeams = "no ground-truth garment has seams";
constexpr const char* kHeldOut = "the capture holds out no cameras or no frames";

/// The stage that `run` does not come by: what nobody asked for is not missing.
constexpr std::string_view kAsked = "refine";

constexpr std::array kTargets = {
    Target{"keypoints.mean_mm", "mm", AtMost, 5, 10, "reconstruct", "there are no detections"},
    Target{"surface.chamfer_mm", "mm", AtMost, 2.5, 4, "reconstruct", "there are no scans"},
    Target{"surface.completeness", "", AtLeast, 0.95, 0.75, "reconstruct", "there are no scans"},
    Target{"surface.floating", "", AtMost, 0.001, 0.01, "reconstruct", "there are no scans"},
    Target{"labels.miou", "", AtLeast, 0.95, 0.95, "reconstruct", "there are no scans"},
    Target{"personal.mean_mm", "mm", AtMost, 3, 7, "personalize", kNoGroundTruth},
    Target{"track.mean_mm", "mm", AtMost, 6, 10, "track", kNoGroundTruth},
    Target{"track.legs_mm", "mm", AtMost, 10, 12, "track", kNoGroundTruth},
    Target{"track.legs_ratio", "", AtMost, 0.5, 1.1, "track", kNotDynamic},
    Target{"track.auto_ratio", "", AtMost, 1.2, 1.3, "track", kNoLabel},
    Target{"body.mean_mm", "mm", AtMost, 5, 8, "body", kNoGroundTruth},
    Target{"body.covered_mean_mm", "mm", AtMost, 8, 10, "body", kNoGroundTruth},
    Target{"body.outside_rate", "", AtMost, 0.03, 0.03, "body", kNoGroundTruth},
    Target{"body.outside_depth_mm", "mm", AtMost, 1, 8, "body", kNoGroundTruth},
    Target{"body.proximity_mm", "mm", AtMost, 1.5, 6, "body", kNoGroundTruth},
    Target{"refine.mean_mm", "mm", AtMost, 5, 8, "refine", kNoGroundTruth},
    Target{"refine.covered_mean_mm", "mm", AtMost, 8, 10, "refine", kNoGroundTruth},
    Target{"refine.outside_rate", "", AtMost, 0.03, 0.03, "refine", kNoGroundTruth},
    Target{"refine.outside_depth_mm", "mm", AtMost, 1, 8, "refine", kNoGroundTruth},
    Target{"refine.proximity_mm", "mm", AtMost, 1.5, 6, "refine", kNoGroundTruth},
    Target{"template.boundaries_wrong", "", AtMost, 0, {}, "template", kNoGroundTruth},
    Target{"template.garments_missed", "", AtMost, 0, {}, "template", kNoGroundTruth},
    Target{"template.not_manifold", "", AtMost, 0, {}, "template", kNoGroundTruth},
    Target{"register.chamfer_mm", "mm", AtMost, 2, 5, "register", kNoGroundTruth},
    Target{"register.point_mean_mm", "mm", AtMost, 3, 20, "register", kNoGroundTruth},
    Target{"register.point_p95_mm", "mm", AtMost, 8, 90, "register", kNoGroundTruth},
    Target{"register.inverted", "", AtMost, 0, 5, "register", kNoGroundTruth},
    Target{"register.drift_mm", "mm", AtMost, 2, 3, "register", kNoGroundTruth},
    Target{"flatten.stretch_p99", "", AtMost, 0.03, 0.05, "flatten", kNoGroundTruth},
    Target{"flatten.seam_mismatch", "", AtMost, 0.003, 0.003, "flatten", kNoGroundTruth},
    Target{"flatten.inverted", "", AtMost, 0, 0, "flatten", kNoGroundTruth},
    // The ground truth's panels and two more a garment: of a dress. measure_flatten says each one's
    // own.
    Target{"flatten.panels", "", AtMost, 8, {}, "flatten", kNoSeams},
    Target{"flatten.seam_ratio", "", AtMost, 1.3, 4, "flatten", kNoSeams},
    Target{"flatten.area_error", "", AtMost, 0.03, {}, "flatten", kNoSeams},
    Target{"material.error", "", AtMost, 0.3, {}, "material", kNoGroundTruth},
    Target{"appearance.psnr_db", "dB", AtLeast, 34, 22, "appearance", kHeldOut},
    Target{"appearance.covered", "", AtLeast, 0.95, 0.9, "appearance", kHeldOut},
    Target{"appearance.below_oracle_db",
           "dB",
           AtMost,
           2,
           {},
           "appearance",
           "the same network was not trained on ground-truth geometry for comparison"},
    Target{"appearance.gain_db", "dB", AtLeast, 4, 1, "appearance", kHeldOut},
    Target{"appearance.shadow_psnr_db", "dB", AtLeast, 33, 21, "appearance", kHeldOut},
    Target{
        "appearance.simulated_psnr_db", "dB", AtLeast, 28, 21, "appearance",
        "the capture does not record how it was synthesized, so that it cannot be simulated again"},
};

const Target* target_of(std::string_view key) {
  const auto found = std::find_if(kTargets.begin(), kTargets.end(),
                                  [&](const Target& target) { return target.key == key; });
  return found == kTargets.end() ? nullptr : &*found;
}

/// What a row says of a measure, by what that is judged by.
void judge(Judged& row, const Measure& measure) {
  row.value = measure.value;
  row.target = target_text(measure.side, measure.target);
  row.verdict = measure.side == None ? "not judged" : is_met(measure) ? "met" : "missed";
  row.missed_by = row.verdict == "missed" ? std::abs(measure.value - measure.target) : 0;
  row.why = measure.note;
}

}  // namespace

std::span<const Target> all_targets() {
  return kTargets;
}

std::string target_text(Measure::Side side, double target) {
  if (side == None) {
    return "none";
  }
  char text[60];
  std::snprintf(text, sizeof(text), "at %s %g", side == AtMost ? "most" : "least", target);
  return text;
}

Measure against(const Measure& measure, Targets targets) {
  Measure judged = measure;
  if (targets == Targets::Accuracy || measure.key.starts_with("capture.")) {
    return judged;
  }
  const Target* target = target_of(measure.key);
  const bool has_range = target != nullptr && target->demo;
  judged.side = has_range ? target->side : None;
  judged.target = has_range ? *target->demo : 0;
  return judged;
}

std::vector<Judged> judged(std::span<const Measure> measures, Targets targets,
                           const std::filesystem::path& workspace) {
  std::vector<Judged> rows;
  for (const Target& target : kTargets) {
    if (target.stage == kAsked && !current_name(results_of_stage(workspace, target.stage))) {
      continue;
    }
    Judged row;
    row.key = target.key;
    row.stage = target.stage;
    row.unit = target.unit;
    const auto found = std::find_if(measures.begin(), measures.end(),
                                    [&](const Measure& one) { return one.key == target.key; });
    if (found != measures.end()) {
      judge(row, against(*found, targets));
    } else {
      const bool judged = targets == Targets::Accuracy || target.demo;
      row.target =
          target_text(judged ? target.side : None,
                      targets == Targets::Accuracy ? target.accuracy : target.demo.value_or(0));
      row.verdict = "not measured";
      row.why = current_name(results_of_stage(workspace, target.stage))
                    ? std::string(target.absent)
                    : "there is no result of " + std::string(target.stage);
    }
    rows.push_back(std::move(row));
  }
  // What is judged and not in the table, as each garment's own figures, counts as well.
  for (const Measure& own : measures) {
    const Measure measure = against(own, targets);
    if (measure.side != None && target_of(measure.key) == nullptr) {
      Judged row;
      row.key = measure.key;
      row.stage = measure.key.substr(0, measure.key.find('.'));
      row.unit = measure.unit;
      judge(row, measure);
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

Targets targets_named(const std::string& name, const std::filesystem::path& capture) {
  constexpr double kAccuracyPixels = 5e5;
  if (name != "auto") {
    return name == "demo" ? Targets::Demo : Targets::Accuracy;
  }
  double pixels = 0;
  for (const Camera& camera : read_cameras(capture)) {
    pixels = std::max(pixels, static_cast<double>(camera.width) * camera.height);
  }
  return pixels < kAccuracyPixels ? Targets::Demo : Targets::Accuracy;
}

}  // namespace atelier
