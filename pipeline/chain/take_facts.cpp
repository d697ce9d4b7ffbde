#include "pipeline/chain/take_facts.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <exception>

#include "core/saturating_cast.h"
#include "core/usage_error.h"

namespace atelier {

CaptureFacts facts_of_take(const std::string& text) {
  std::array<double, 3> numbers{};
  std::size_t at = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t end = i + 1 < numbers.size() ? text.find('x', at) : text.size();
    const std::string part = end == std::string::npos ? "" : text.substr(at, end - at);
    std::size_t read = 0;
    try {
      numbers[i] = std::stod(part, &read);
    } catch (const std::exception&) {
      read = 0;
    }
    const bool whole = i == 2 || numbers[i] == std::floor(numbers[i]);
    if (part.empty() || read != part.size() || !whole || !(numbers[i] > 0 && numbers[i] <= 1e6)) {
      throw UsageError("--take cannot be '" + text.substr(0, 60) +
                       "': it takes cameras, frames and megapixels, such as 200x10000x4");
    }
    at = end + 1;
  }
  CaptureFacts facts;
  facts.calibrated = facts.detections = true;
  facts.cameras = saturating_cast<int>(numbers[0]);
  facts.frames = facts.pictured_frames = facts.masked_frames = saturating_cast<int>(numbers[1]);
  facts.minimal_frames = facts.frames / 10;
  facts.clothed_frames = facts.frames - facts.minimal_frames;
  facts.megapixels = numbers[2];
  return facts;
}

}  // namespace atelier
