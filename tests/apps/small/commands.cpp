#include "apps/command.h"
#include "apps/outdated_results.h"

namespace atelier {
namespace {

constexpr Command kCommands[] = {{"status", "what a workspace holds", add_status}};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

/// What makes a result anew is known to the chain of `run`, which this program is without.
std::vector<std::string> outdated_inputs(const Stage& /*stage*/, const StageRequest& /*request*/) {
  return {};
}

}  // namespace atelier
