#ifdef ATELIER_HAS_CAPTURE

#include "apps/targets.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "core/store/result.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kNoTruth = "no frame has both a result and a truth";
constexpr const char* kNotDynamic = "no clothing was found to swing, so that nothing is left out";
constexpr const char* kHeldOut = "the capture holds out no cameras or no frames";

constexpr std::array kTargets = {
    Target{"keypoints.mean_mm", "mm", AtMost, 5, {}, "reconstruct", "there are no detections"},
    Target{"surface.chamfer_mm", "mm", AtMost, 2.5, {}, "reconstruct", "there are no scans"},
    Target{"surface.completeness", "", AtLeast, 0.95, {}, "reconstruct", "there are no scans"},
    Target{"surface.floating", "", AtMost, 0.001, {}, "reconstruct", "there are no scans"},
    Target{"labels.miou", "", AtLeast, 0.95, {}, "reconstruct", "there are no scans"},
    Target{"personal.mean_mm", "mm", AtMost, 3, {}, "personalize", kNoTruth},
    Target{"track.mean_mm", "mm", AtMost, 6, {}, "track", kNoTruth},
    Target{"track.legs_mm", "mm", AtMost, 10, {}, "track", kNoTruth},
    Target{"track.legs_ratio", "", AtMost, 0.5, {}, "track", kNotDynamic},
    Target{"track.auto_ratio", "", AtMost, 1.2, {}, "track", kNotDynamic},
    Target{"body.mean_mm", "mm", AtMost, 5, {}, "body", kNoTruth},
    Target{"body.covered_mean_mm", "mm", AtMost, 8, {}, "body", kNoTruth},
    Target{"body.outside_rate", "", AtMost, 0.03, {}, "body", kNoTruth},
    Target{"body.outside_depth_mm", "mm", AtMost, 1, {}, "body", kNoTruth},
    Target{"body.proximity_mm", "mm", AtMost, 1.5, {}, "body", kNoTruth},
    Target{"register.chamfer_mm", "mm", AtMost, 2, {}, "register", kNoTruth},
    Target{"register.point_mean_mm", "mm", AtMost, 3, {}, "register", kNoTruth},
    Target{"register.point_p95_mm", "mm", AtMost, 8, {}, "register", kNoTruth},
    Target{"register.inverted", "", AtMost, 0, {}, "register", kNoTruth},
    Target{"register.drift_mm", "mm", AtMost, 2, {}, "register", kNoTruth},
    Target{"flatten.stretch_p99", "", AtMost, 0.03, {}, "flatten", kNoTruth},
    Target{"flatten.seam_mismatch", "", AtMost, 0.003, {}, "flatten", kNoTruth},
    Target{"flatten.inverted", "", AtMost, 0, {}, "flatten", kNoTruth},
    Target{"flatten.seam_ratio",
           "",
           AtMost,
           1.3,
           {},
           "flatten",
           "the true garment has no seams to compare with"},
    Target{"material.error", "", AtMost, 0.3, {}, "material", kNoTruth},
    Target{"appearance.psnr_db", "dB", AtLeast, 34, {}, "appearance", kHeldOut},
    Target{"appearance.below_ceiling_db",
           "dB",
           AtMost,
           2,
           {},
           "appearance",
           "the same network was not trained on true geometry beside it"},
    Target{"appearance.gain_db", "dB", AtLeast, 4, {}, "appearance", kHeldOut},
    Target{"appearance.shadow_psnr_db", "dB", AtLeast, 33, {}, "appearance", kHeldOut},
    Target{"appearance.simulated_psnr_db",
           "dB",
           AtLeast,
           28,
           {},
           "appearance",
           "no simulated motion was rendered to compare with"},
};

/// The side and the number that a row is judged by.
std::pair<Measure::Side, double> judge_of(const Target& row, const Measure* measure,
                                          Targets targets) {
  if (targets == Targets::Demo) {
    return row.demo ? std::pair(row.side, *row.demo) : std::pair(None, 0.0);
  }
  return measure != nullptr ? std::pair(measure->side, measure->target)
                            : std::pair(row.side, row.accuracy);
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

std::vector<Judged> judged(std::span<const Measure> measures, Targets targets,
                           const std::filesystem::path& workspace) {
  std::vector<Judged> rows;
  for (const Target& target : kTargets) {
    const auto found = std::find_if(measures.begin(), measures.end(),
                                    [&](const Measure& one) { return one.key == target.key; });
    const Measure* measure = found == measures.end() ? nullptr : &*found;
    const auto [side, number] = judge_of(target, measure, targets);
    Judged row;
    row.key = target.key;
    row.unit = target.unit;
    row.target = target_text(side, number);
    if (measure != nullptr) {
      Measure against = *measure;
      against.side = side;
      against.target = number;
      row.value = measure->value;
      row.verdict = side == None ? "not judged" : is_met(against) ? "met" : "missed";
      row.why = measure->note;
    } else {
      row.verdict = "not measured";
      row.why = current_name(workspace / target.stage)
                    ? std::string(target.absent)
                    : "there is no result of " + std::string(target.stage);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

bool any_missed(const std::vector<Judged>& rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const Judged& row) { return row.verdict == "missed"; });
}

}  // namespace atelier

#endif
