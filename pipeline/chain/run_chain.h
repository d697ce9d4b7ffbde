#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/layouts/capture_facts.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

/// Every stage of the chain from images to avatar (StageRow::chain), in the order in which they
/// run.
std::span<const StageRow* const> run_steps();

/// Their names.
std::vector<std::string> step_names();

/// Why the capture has nothing for a step, one sentence; "" if it has.
std::string nothing_for(const StageRow& step, const CaptureFacts& facts);

/// Stages without whose results a step cannot run.
std::vector<std::string_view> needed_stages(const StageRow& step, const CaptureFacts& facts);

/// Stages whose results a step reads where they are.
std::vector<std::string_view> optional_stages(const StageRow& step);

/// Seconds that a step is expected to take for a capture on this machine. An estimate: motion,
/// clothing and processor may make it several times more or less.
double expected_seconds(const StageRow& step, const CaptureFacts& facts);

/// The same on a number of processor cores of a machine like this one.
double expected_seconds(const StageRow& step, const CaptureFacts& facts, int cores);

/// Memory that a step is expected to need for a capture, 10^6 bytes, with so many frames worked on
/// at once. An estimate, meant to be enough.
double expected_megabytes(const StageRow& step, const CaptureFacts& facts, int jobs);

/// Seconds of the report at the end: every result is digested and drawn, and where the capture is
/// synthetic compared with its truth.
/// @param stages  those that have results then
double expected_report_seconds(const CaptureFacts& facts, std::span<const std::string> stages);

}  // namespace atelier
