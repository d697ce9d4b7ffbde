#include "core/store/content_sketch.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <limits>

namespace atelier {
namespace {

constexpr std::size_t kSketchDigits = 16;  // of a number

/// The largest number up to which a sketch has every one.
std::uint64_t complete_up_to(const ContentSketch& sketch) {
  return sketch.size() < kSketchSize ? std::numeric_limits<std::uint64_t>::max() : sketch.back();
}

}  // namespace

ContentSketch content_sketch(std::vector<std::uint64_t> files) {
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  files.resize(std::min(files.size(), kSketchSize));
  return files;
}

SharedFiles shared_files(const ContentSketch& of, const ContentSketch& in) {
  SharedFiles result;
  if (of.empty() || in.empty()) {
    return result;
  }
  const std::uint64_t end = complete_up_to(in);
  for (const std::uint64_t file : of) {
    if (file <= end) {
      ++result.compared;
      result.shared += std::binary_search(in.begin(), in.end(), file) ? 1 : 0;
    }
  }
  return result;
}

bool holds_mostly(const ContentSketch& of, const ContentSketch& in) {
  const SharedFiles files = shared_files(of, in);
  return files.compared > 0 && 4 * files.shared >= 3 * files.compared;
}

std::string sketch_text(const ContentSketch& sketch) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint64_t number : sketch) {
    for (int shift = 60; shift >= 0; shift -= 4) {
      text += kDigits[(number >> shift) & 15];
    }
  }
  return text;
}

bool parse_sketch(std::string_view text, ContentSketch& sketch) {
  sketch.clear();
  if (text.size() % kSketchDigits != 0 || text.size() > kSketchSize * kSketchDigits) {
    return false;
  }
  for (std::size_t at = 0; at < text.size(); at += kSketchDigits) {
    std::uint64_t number = 0;
    std::from_chars(text.data() + at, text.data() + at + kSketchDigits, number, 16);
    sketch.push_back(number);
  }
  return sketch_text(sketch) == text &&
         std::adjacent_find(sketch.begin(), sketch.end(), std::greater_equal<>()) == sketch.end();
}

}  // namespace atelier
