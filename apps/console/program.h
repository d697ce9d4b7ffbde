#pragma once

#include <string>
#include <vector>

namespace atelier {

/// Runs the program with its arguments (without its own name) and returns the exit code. Throws
/// UsageError, DataError, EnvironmentError and LogicError, which main turns into theirs.
int run_program(std::vector<std::string> arguments);

}  // namespace atelier
