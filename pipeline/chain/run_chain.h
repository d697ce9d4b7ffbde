#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/layouts/capture_facts.h"

namespace atelier {

/// Where a run reads and writes.
struct RunPlaces {
  std::filesystem::path capture;
  std::filesystem::path workspace;
};

/// How long a stage takes: on the two processor cores on which it was measured
/// (docs/results/demo_ranges.md has the times that these follow from).
struct StageCost {
  double seconds = 0;      ///< once
  double per_picture = 0;  ///< s, of a megapixel of each camera in each frame that is read
  double per_frame = 0;    ///< s, of each frame
  double per_clothed = 0;  ///< s, of each clothed frame with masks
  bool parallel = false;   ///< goes with the number of cores
};

/// One stage of the chain from images to avatar. A stage that this program does not have (its row
/// is missing in the table of stages) is passed over with a line.
struct RunStep {
  std::string_view stage;
  /// Why the capture has nothing for it, one sentence; "" if it has.
  std::string (*lacks)(const CaptureFacts& facts);
  /// Stages whose results its INPUT is made of, beside those that its row names.
  std::vector<std::string_view> (*made_of)(const CaptureFacts& facts) = nullptr;
  /// Its INPUT, written into the workspace where it is made of results; null: the capture.
  std::filesystem::path (*input)(const RunPlaces& places, const CaptureFacts& facts) = nullptr;
  StageCost cost{};
};

/// Every step, in the order in which they run.
std::span<const RunStep> run_steps();

/// Stages without whose results a step cannot run.
std::vector<std::string_view> needed_stages(const RunStep& step, const CaptureFacts& facts);

/// Stages whose results a step reads where they are.
std::vector<std::string_view> optional_stages(const RunStep& step);

/// Seconds that a step is expected to take for a capture on this machine. An estimate: motion,
/// clothing and processor may make it several times more or less.
double expected_seconds(const RunStep& step, const CaptureFacts& facts);

/// The same of the report at the end: every result is digested, and where the capture is synthetic
/// compared with its truth.
double expected_report_seconds(const CaptureFacts& facts);

}  // namespace atelier
