#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/measure.h"
#include "pipeline/evaluation/targets.h"

namespace atelier {

/// Everything that has measures: "capture", then stages in the order of their measures.
std::vector<std::string> evaluated_stages();

/// A stage whose result is there, but whose figures would say nothing or cannot be taken; or which
/// was asked for and has no result.
struct Unmeasured {
  std::string stage;
  std::string why;       ///< and the command that mends it
  bool damaged = false;  ///< something that it reads
};

/// Measures of a workspace against the ground truth.
struct WorkspaceFigures {
  std::vector<Measure> measures;
  std::vector<Unmeasured> unmeasured;
};

/// Every figure that the results of a workspace give against the ground truth of the synthetic
/// capture that they were made from, stage by stage. Not measured are: results that are outdated
/// (their inputs or the stage have changed since, or those of anything that they rest on);
/// `personalize` of another body model than the ground truth's, whose rest poses are not the same;
/// and what reads a damaged result, so that one file does not take all other figures with it.
/// @param stage  of this one alone, or "capture" for the capture itself; "": of all
/// Throws UsageError for a stage that has no figures, DataError for the ground truth of another
/// capture than the one that the results were made from (neither its content nor its place), else
/// as the readers of the ground truth do.
WorkspaceFigures workspace_figures(const std::filesystem::path& workspace,
                                   const std::filesystem::path& truth,
                                   const std::string& stage = "");

/// The table of targets for them (pipeline/evaluation/targets.h), with why a stage was not
/// measured.
std::vector<Judged> judged(const WorkspaceFigures& figures, Targets targets,
                           const std::filesystem::path& workspace);

/// "met (at most 6)", "MISSED (at least 0.95)", "" without a target.
std::string verdict_of(const Measure& measure);

}  // namespace atelier
