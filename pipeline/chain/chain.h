#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "capture/layouts/capture_facts.h"
#include "core/options.h"
#include "core/store/frame_selection.h"
#include "core/store/stage_plan.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/pictures/run_account.h"

namespace atelier {

/// The request of a run of the chain, beside the options of its stages.
struct ChainRequest {
  RunPlaces places;
  std::string from;  ///< first stage; "": the chain's
  std::string to;    ///< last stage; "": the chain's
  int jobs = 0;      ///< frames worked on at once; 0: as many as processors
  std::string device = "cpu";
  std::string material;      ///< one fabric for all garments; "": fitted ones
  FrameSelection selection;  ///< of the one stage that it does
  bool without_report = false;
  std::vector<std::string> set_aside;  ///< stages whose results count as not there in a dry run
  bool dry_run = false;
};

/// Whether the run ends with a report: on whole stages, unless it is not asked for.
bool writes_report(const ChainRequest& request);

/// The work that remains for one stage, as far as that can be told before the stages in front of it
/// have run.
struct ForeseenStage {
  std::string words;  ///< "would run"
  std::vector<std::string> why;
  bool works = false;                      ///< takes its time: unlikely to find its result as it is
  bool cannot = false;                     ///< lacks what this run does not make
  std::vector<std::string> warnings = {};  ///< of what its options name
};

/// A run of the chain: its request, its account so far, and the outlook for the rest.
struct Chain {
  ChainRequest request;
  OptionSet options;  ///< of `run_options`, with what this capture asks for
  CaptureFacts facts;
  RunAccount account;                   ///< a stage without an end is to run
  std::vector<ForeseenStage> foreseen;  ///< of each stage of the account, after `foresee_work`
  double report_pace = 1;  ///< times that a report takes longer than its parts are expected to
};

/// A run before its first stage, with those stages ended that it skips. Times are those of the
/// workspace's last run of the capture, or estimates.
/// @param options  as `run_options` makes them; what the capture asks for is set where nobody set
///                 anything else. Throws as `capture_facts`.
Chain begin_chain(const ChainRequest& request, const OptionSet& options);

/// Marks stages as skipped: those outside of the request, not in this program, without data in the
/// capture, and those that read results of skipped or failed stages. Returns the places of those
/// that are newly skipped.
std::vector<std::size_t> skip_stages(Chain& chain);

/// Refuses a run that could not complete, before anything is done: a capture for which every stage
/// is skipped, a stage that lacks a result which this run does not make, files that options name
/// and that are missing. Throws DataError, EnvironmentError.
void require_feasible(const Chain& chain);

/// Why every requested stage is skipped, other than the one that checks any capture; "" if one is
/// not.
std::string why_all_skipped(const Chain& chain);

/// The account of a stage; null if the chain has none of that name.
const RunStageAccount* account_of(const Chain& chain, std::string_view stage);

/// Whether the workspace has a result of a stage that this run may read.
bool has_current_result(const Chain& chain, const std::string& stage);

/// The request of the stage at a place.
/// @param make_input  an INPUT that is made of results is written; otherwise it is the capture
StageRequest chain_request(const Chain& chain, std::size_t i, bool make_input);

/// Differences in options and device from those that a stage's current result was made with, or
/// that it is damaged. For a stage whose INPUT is made of results, of which no plan can be made
/// before. Precondition: the stage has a current result.
std::vector<std::string> option_changes(const Chain& chain, std::size_t i);

}  // namespace atelier
