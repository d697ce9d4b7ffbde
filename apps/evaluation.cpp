#ifdef ATELIER_HAS_CAPTURE

#include "apps/evaluation.h"

#include <cstdio>

#include "apps/animate_measures.h"
#include "apps/appearance_measures.h"
#include "apps/body_measures.h"
#include "apps/flatten_measures.h"
#include "apps/person_measures.h"
#include "apps/reconstruct_measures.h"
#include "apps/register_measures.h"
#include "apps/template_measures.h"
#include "apps/usage_error.h"
#include "core/nearest_name.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// What can be measured, one row for each stage as it comes. A row measures the results of its
/// stage in the workspace against the truth; none where there are none.
struct Evaluation {
  const char* stage;
  std::vector<Measure> (*measure)(const fs::path& workspace, const fs::path& truth);
  /// Why its result cannot be measured; "" if it can. Null: it always can.
  std::string (*problem)(const fs::path& workspace, const fs::path& truth) = nullptr;
};

std::vector<Measure> of_capture(const fs::path& /*workspace*/, const fs::path& truth) {
  return measure_capture(truth);
}

constexpr Evaluation kEvaluations[] = {
    {"capture", of_capture},
#ifdef ATELIER_HAS_CAPTURE_SURFACE
    {"reconstruct", measure_reconstruct},
#endif
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)
    {"personalize", measure_personalize, personalize_problem},
    {"track", measure_track, track_problem},
#endif
#ifdef ATELIER_HAS_REGISTRATION
    {"template", measure_template},
    {"register", measure_register},
    {"flatten", measure_flatten},
#endif
#ifdef ATELIER_HAS_BODYMODEL
    {"body", measure_body},
    {"refine", measure_refine},
#endif
#if defined(ATELIER_HAS_APPEARANCE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL)
    {"appearance", measure_appearance},
#endif
#if defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_SIMULATION) && \
    defined(ATELIER_HAS_BODYMODEL) && defined(ATELIER_HAS_CORE_RENDER)
    {"material", measure_material},
    {"animate", measure_animate},
#endif
};

std::string problem_of(const Evaluation& evaluation, const fs::path& workspace,
                       const fs::path& truth) {
  return evaluation.problem == nullptr ? "" : evaluation.problem(workspace, truth);
}

}  // namespace

std::vector<std::string> evaluated_stages() {
  std::vector<std::string> stages;
  for (const Evaluation& evaluation : kEvaluations) {
    stages.emplace_back(evaluation.stage);
  }
  return stages;
}

std::vector<Unmeasured> unmeasured_stages(const fs::path& workspace, const fs::path& truth,
                                          const std::string& stage) {
  std::vector<Unmeasured> all;
  for (const Evaluation& evaluation : kEvaluations) {
    if (stage.empty() || stage == evaluation.stage) {
      if (std::string why = problem_of(evaluation, workspace, truth); !why.empty()) {
        all.push_back({evaluation.stage, std::move(why)});
      }
    }
  }
  return all;
}

std::vector<Measure> workspace_measures(const fs::path& workspace, const fs::path& truth,
                                        const std::string& stage) {
  std::vector<Measure> all;
  std::string stages;
  std::vector<std::string> names;
  bool known = stage.empty();
  for (const Evaluation& evaluation : kEvaluations) {
    stages += std::string(stages.empty() ? "" : ", ") + evaluation.stage;
    names.emplace_back(evaluation.stage);
    if (stage.empty() || stage == evaluation.stage) {
      known = true;
      if (!problem_of(evaluation, workspace, truth).empty()) {
        continue;
      }
      const std::vector<Measure> some = evaluation.measure(workspace, truth);
      all.insert(all.end(), some.begin(), some.end());
    }
  }
  if (!known) {
    const std::string name = stage.substr(0, 80);
    const std::string meant = did_you_mean(name, names);
    throw UsageError("'" + name + "' has no figures" +
                     (meant.empty() ? "; these have: " + stages : meant));
  }
  return all;
}

std::string verdict_of(const Measure& measure) {
  if (measure.side == Measure::Side::None) {
    return "";
  }
  char text[80];
  std::snprintf(text, sizeof(text), "%s (%s %g)", is_met(measure) ? "met" : "MISSED",
                measure.side == Measure::Side::AtMost ? "at most" : "at least", measure.target);
  return text;
}

}  // namespace atelier

#endif
