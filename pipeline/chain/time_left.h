#pragma once

#include <span>

namespace atelier {

/// A stage of a run that has ended, or that goes on and says how long it still takes.
struct StageTime {
  double expected = 0;  ///< s, before the run
  double taken = 0;     ///< s
};

/// How many times longer than expected the stages of a run take, in [0.1, 10]: the geometric mean
/// of their ratios, each with the weight e / (e + 5 s) of its expected seconds e, and 1 with the
/// weight 0.25 (our choice: stages of a second say little, a first one of minutes nearly all). 1
/// where no stage has a time.
double run_pace(std::span<const StageTime> stages);

/// How many times longer this machine takes now for a fixed piece of arithmetic, on every thread
/// that stages use, than the idle one on which the costs of stages (StageCost) were measured; in
/// [0.25, 8]. Takes some hundredths of a second.
double machine_pace();

}  // namespace atelier
