#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/options.h"

namespace atelier {

/// Sets options from TOML text: `[solver]` with `substeps = 20` sets "solver.substeps", and notes
/// "<file>:<line>" as who set it. Returns one sentence for each value that was refused (unknown
/// name, out of range, of another kind), all of them, so that a user corrects a file once; the
/// others are set. Throws DataError if the text is no TOML or beyond the limits.
std::vector<std::string> set_options_from_toml(OptionTable& table, std::string_view text,
                                               const std::string& file);

}  // namespace atelier
