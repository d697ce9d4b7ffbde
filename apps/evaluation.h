#pragma once

#ifdef ATELIER_HAS_CAPTURE

#include <filesystem>
#include <string>
#include <vector>

#include "capture/capture_measures.h"

namespace atelier {

/// Every figure that the results of a workspace give against the truth of the synthetic capture
/// that they were made from, stage by stage.
/// @param stage  of this one alone, or "capture" for the capture itself; "": of all
/// Throws UsageError for a stage that has no figures, else as the readers of results and truth do.
std::vector<Measure> workspace_measures(const std::filesystem::path& workspace,
                                        const std::filesystem::path& truth,
                                        const std::string& stage = "");

/// What has figures: "capture", then stages in the order of a run.
std::vector<std::string> evaluated_stages();

/// A stage whose result is there, but whose figures would say nothing.
struct Unmeasured {
  std::string stage;
  std::string why;  ///< and the command that mends it
};

/// What workspace_measures leaves out, of that stage or of all: results that are outdated (their
/// inputs, or the stage, have changed since), and `personalize` of another body model than the
/// truth's, whose rest poses are not the same.
std::vector<Unmeasured> unmeasured_stages(const std::filesystem::path& workspace,
                                          const std::filesystem::path& truth,
                                          const std::string& stage = "");

/// "met (at most 6)", "MISSED (at least 0.95)", "" without a target.
std::string verdict_of(const Measure& measure);

}  // namespace atelier

#endif
