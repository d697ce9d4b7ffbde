#pragma once

#include <stdexcept>

namespace atelier {

/// An optimisation that came to nothing of use. The program exits with 4.
struct NotConverged : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace atelier
