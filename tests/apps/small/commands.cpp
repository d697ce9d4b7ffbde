#include "apps/command.h"

namespace atelier {
namespace {

constexpr Command kCommands[] = {{"status", "what a workspace holds", add_status}};

}  // namespace

std::span<const Command> all_commands() {
  return kCommands;
}

}  // namespace atelier
