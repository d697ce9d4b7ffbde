#include <array>

#include "pipeline/row/stage_row.h"
#include "tests/pipeline/toy/toy_stage.h"

namespace atelier {
namespace {

constexpr std::array kToyTargets = {
    Target{"toy.error", "error of the sum", "", Measure::Side::AtMost, 0.5, 1},
};

constexpr std::array kToyOrder = {
    OrderRule{"low", "high", is_less, kTakesLess},
};
constexpr OptionRules kToyRules{.order = kToyOrder};

}  // namespace

const StageRow& toy_row() {
  static const StageRow row{
      .stage = {.name = "toy",
                .version = 1,
                .summary = "numbers of a file, clamped and added",
                .inputs = {"numbers"},
                .outputs = {"sum"},
                .metrics = kToyMetrics,
                .options = option_set<ToyOptions>,
                .run = run_toy,
                .frame_wise = true},
      .chain = ChainPlace{.cost = {.seconds = 1, .per_frame = 2}},
      .measure = measure_toy,
      .targets = kToyTargets,
      .rules = &kToyRules,
      .pictures = toy_pictures,
  };
  return row;
}

}  // namespace atelier
