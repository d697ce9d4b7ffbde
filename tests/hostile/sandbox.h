#pragma once

#include <functional>
#include <string>

#include "tests/hostile/readers.h"

namespace atelier::fixtures {

/// Reads many inputs in a child process that may take 512 MB of memory more than it has at its
/// start and 10 s per input. `input(i)` makes the i-th of `count` inputs.
/// @return "" if each was read or refused by DataError; else a sentence that names the input and
///         what happened (another exception, a signal, out of memory, too slow), and the path of
///         the input, kept beside the test program (hostile-failed/).
std::string read_all_in_sandbox(const Reader& reader, std::size_t count,
                                const std::function<Bytes(std::size_t i)>& input);

}  // namespace atelier::fixtures
