#ifdef ATELIER_HAS_CAPTURE

#include "apps/evaluation.h"

#include <cstdio>

#include "apps/animate_measures.h"
#include "apps/appearance_measures.h"
#include "apps/body_measures.h"
#include "apps/flatten_measures.h"
#include "apps/output_place.h"
#include "apps/person_measures.h"
#include "apps/reconstruct_measures.h"
#include "apps/register_measures.h"
#include "apps/template_measures.h"
#include "apps/usage_error.h"
#include "core/error.h"
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

/// Why a stage cannot be measured that reads a file which cannot be read, and what mends it.
std::string damage_text(const DataError& error, const fs::path& workspace) {
  const std::string text = error.what();
  const fs::path file = fs::weakly_canonical(fs::current_path() / error.file);
  if (error.file.empty() || !is_inside(file, workspace) ||
      text.find("run 'atelier ") != std::string::npos) {
    return text;
  }
  const fs::path inside = file.lexically_relative(fs::weakly_canonical(workspace));
  return text + "; run 'atelier " + inside.begin()->string() + "' again with --force";
}

}  // namespace

std::vector<std::string> evaluated_stages() {
  std::vector<std::string> stages;
  for (const Evaluation& evaluation : kEvaluations) {
    stages.emplace_back(evaluation.stage);
  }
  return stages;
}

WorkspaceFigures workspace_figures(const fs::path& workspace, const fs::path& truth,
                                   const std::string& stage) {
  WorkspaceFigures all;
  std::string stages;
  std::vector<std::string> names;
  bool known = stage.empty();
  for (const Evaluation& evaluation : kEvaluations) {
    stages += std::string(stages.empty() ? "" : ", ") + evaluation.stage;
    names.emplace_back(evaluation.stage);
    if (stage.empty() || stage == evaluation.stage) {
      known = true;
      try {
        if (std::string why = problem_of(evaluation, workspace, truth); !why.empty()) {
          all.unmeasured.push_back({evaluation.stage, std::move(why), false});
          continue;
        }
        const std::vector<Measure> some = evaluation.measure(workspace, truth);
        all.measures.insert(all.measures.end(), some.begin(), some.end());
      } catch (const DataError& error) {
        if (evaluation.measure == of_capture || is_inside(error.file, truth)) {
          throw;  // without the truth nothing can be measured
        }
        all.unmeasured.push_back({evaluation.stage, damage_text(error, workspace), true});
      }
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

std::vector<Judged> judged(const WorkspaceFigures& figures, Targets targets,
                           const fs::path& workspace) {
  std::vector<Judged> rows = judged(figures.measures, targets, workspace);
  for (Judged& row : rows) {
    for (const Unmeasured& one : figures.unmeasured) {
      row.why = !row.value && row.stage == one.stage ? one.why : row.why;
    }
  }
  return rows;
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
