#include "core/check_bounded.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/error.h"

namespace atelier {
namespace {

/// "1e+300", where std::to_string has three hundred digits.
std::string short_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

}  // namespace

void check_bounded(const Tensor& tensor, double most, const std::string& file,
                   const std::string& name) {
  check_finite(tensor, file, name);
  const std::vector<double> values = doubles_of(tensor, file, name);
  const auto beyond = std::find_if(values.begin(), values.end(),
                                   [&](double value) { return std::abs(value) > most; });
  if (beyond != values.end()) {
    throw DataError(file, name + "[" + std::to_string(beyond - values.begin()) + "]",
                    short_text(*beyond), "at most " + short_text(most));
  }
}

}  // namespace atelier
