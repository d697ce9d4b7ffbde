#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/store/workspace_status.h"
#include "pipeline/pictures/report_gauges.h"

namespace atelier {

/// Data of the first sentences of a report.
struct SummaryFacts {
  std::span<const StageStatus> stages;
  std::span<const Gauge> gauges;         ///< every figure that has a target
  std::span<const std::string> unknown;  ///< what no figure says, noun phrases
  std::size_t errors = 0;                ///< that the page lists
  std::size_t warnings = 0;
};

/// Three sentences in HTML: what is good (the figures farthest inside their targets), what is not
/// (those farthest outside, results that are not sound, how much asks for attention), and what
/// nobody knows.
std::string report_summary(const SummaryFacts& facts);

/// "a, b and 3 more", of more than `most`; else "a, b and c".
std::string some_of(const std::vector<std::string>& names, std::size_t most);

}  // namespace atelier
