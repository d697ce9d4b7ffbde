#include "apps/console/command.h"
#include "apps/console/stand_alone.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/chain/startable_without.h"

namespace atelier {
namespace {

constexpr Command kCommands[] = {{"status", "what a workspace holds", add_status}};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

std::string_view commands_left_out() {
  return "masks";
}

std::span<const StandAlone> all_stand_alone() {
  return {};
}

/// What makes a result anew is known to the chain of `run`, which this program is without.
std::vector<std::string> outdated_inputs(const Stage& /*stage*/, const StageRequest& /*request*/) {
  return {};
}

/// Nor are captures, of which this program reads none.
void require_startable_without(const Stage& /*stage*/, const StageRequest& /*request*/,
                               std::span<const std::string> /*aside*/) {}

}  // namespace atelier
