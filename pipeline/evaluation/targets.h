#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/measure.h"
#include "pipeline/row/target.h"

namespace atelier {

/// Which targets results are judged by.
enum class Targets {
  Accuracy,  ///< captures as the preset "accuracy" makes them
  Demo,      ///< as the preset "demo": the ranges of docs/results/demo_ranges.md
};

/// The table of targets: those of every stage (StageRow::targets), as the rooms are listed.
std::span<const Target> all_targets();

/// A row with what was measured.
struct Judged {
  std::string key;
  std::string stage;  ///< whose result is measured
  std::string words;  ///< what it is, a noun phrase that stands alone; "" where only `why` says it
  std::optional<double> value;
  std::string unit;
  std::string target;    ///< "at most 5"; "none" where it is not judged
  std::string verdict;   ///< "met", "missed", "not judged" or "not measured"
  std::string why;       ///< over what it was taken, or why it was not
  double missed_by = 0;  ///< how far it is from its target, where that is missed
  Measure::Side side = Measure::Side::None;
  double limit = 0;  ///< the target as a number, of a side that is not None
};

/// The measure with what it is judged by: on `accuracy` by its own target, which may be sharper
/// than the table's (from ground-truth scans); on `demo` by the table's range, if it has one.
/// Figures of the capture itself keep theirs.
Measure against(const Measure& measure, Targets targets);

/// The table of targets for a workspace, given everything that was measured; then every figure that
/// is judged and not in it.
std::vector<Judged> judged(std::span<const Measure> measures, Targets targets,
                           const std::filesystem::path& workspace);

/// "accuracy" or "demo"; "auto": by the size of the capture's images, "demo" below half a
/// megapixel.
Targets targets_named(const std::string& name, const std::filesystem::path& capture);

/// "at most 5"; "none" for Side::None.
std::string target_text(Measure::Side side, double target);

}  // namespace atelier
