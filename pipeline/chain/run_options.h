#pragma once

#include <map>
#include <string>

#include "capture/layouts/open_dataset.h"
#include "core/options.h"

namespace atelier {

/// The options of every stage behind one table, each under its stage's name ("track.exclude"); and
/// under "capture." those of the capture, which every stage that opens it takes. Values point into
/// the sets.
struct RunOptions {
  OptionSet capture;                        ///< DatasetOptions
  std::map<std::string, OptionSet> stages;  ///< by name
  OptionSet report;
};

/// The defaults, as one set: TOML has `[capture]`, `[track]`, `[reconstruct.stereo]`.
OptionSet run_options();

/// The part of a set of `run_options` that one stage takes: its own options, with their origin; and
/// where it has an option of the capture that nobody set, the one of the whole run.
OptionSet stage_options(const OptionSet& run, const std::string& stage);

/// The options of the capture among those of a stage, "capture.fps" or "input.capture.fps";
/// defaults of those that it does not have.
DatasetOptions capture_options(const OptionTable& stage);

}  // namespace atelier
