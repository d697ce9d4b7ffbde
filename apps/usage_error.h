#pragma once

#include <stdexcept>

namespace atelier {

/// The command line or an options file is wrong. The program exits with 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace atelier
