#include "capture/frame_number.h"

#include <algorithm>
#include <charconv>
#include <string>

namespace atelier {
namespace {

bool is_decimal(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

std::vector<std::string_view> digit_runs(std::string_view file_name) {
  const std::size_t slash = file_name.rfind('/');
  if (slash != std::string_view::npos) {
    file_name.remove_prefix(slash + 1);
  }
  const std::size_t dot = file_name.rfind('.');
  if (dot != std::string_view::npos && dot > 0) {
    file_name = file_name.substr(0, dot);
  }
  std::vector<std::string_view> runs;
  for (std::size_t begin = 0; begin < file_name.size();) {
    std::size_t end = begin;
    while (end < file_name.size() && is_decimal(file_name[end])) {
      ++end;
    }
    if (end > begin) {
      runs.push_back(file_name.substr(begin, end - begin));
    }
    begin = std::max(end, begin + 1);
  }
  return runs;
}

std::optional<std::int64_t> long_number(std::string_view digits) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc() && end == digits.data() + digits.size() ? std::optional(number)
                                                                      : std::nullopt;
}

std::optional<int> frame_number(std::string_view file_name, std::size_t from_end) {
  const std::vector<std::string_view> runs = digit_runs(file_name);
  if (runs.size() <= from_end) {
    return std::nullopt;
  }
  const std::optional<std::int64_t> number = long_number(runs[runs.size() - 1 - from_end]);
  constexpr std::int64_t kMost = 999'999'999;
  return number && *number <= kMost ? std::optional(static_cast<int>(*number)) : std::nullopt;
}

std::size_t number_digits(std::string_view file_name, std::size_t from_end) {
  const std::vector<std::string_view> runs = digit_runs(file_name);
  return runs.size() > from_end ? runs[runs.size() - 1 - from_end].size() : 0;
}

void continue_counter(std::vector<std::pair<int, std::uint32_t>>& numbers, std::size_t digits) {
  constexpr int kFour = 10'000;  // five digits of some cameras count to 9999, too
  constexpr std::size_t kFewest = 4;
  constexpr std::size_t kMost = 8;
  if (numbers.size() < 4 || digits < kFewest || digits > kMost) {
    return;
  }
  int range = kFour;
  for (std::size_t k = kFewest; k < digits && numbers.back().first >= kFour; ++k) {
    range *= 10;
  }
  const std::size_t last = numbers.size() - 1;
  const int first = numbers.front().first;
  const bool both_ends = numbers[last].first == range - 1 && first <= 1 &&
                         numbers[last - 1].first == range - 2 && numbers[1].first == first + 1;
  const auto gap = std::adjacent_find(
      numbers.begin(), numbers.end(),
      [&](const auto& a, const auto& b) { return b.first - a.first > range / 2; });
  if (!both_ends || gap == numbers.end()) {
    return;
  }
  for (auto it = numbers.begin(); it <= gap; ++it) {
    it->first += range - first;
  }
  std::rotate(numbers.begin(), gap + 1, numbers.end());
}

bool is_camera_number(std::string_view file_name, std::string_view digits) {
  const std::size_t at = file_name.rfind(digits);
  std::string before(file_name.substr(0, at == std::string_view::npos ? 0 : at));
  while (!before.empty() && (before.back() == '_' || before.back() == '-')) {
    before.pop_back();
  }
  std::transform(before.begin(), before.end(), before.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return before.ends_with("cam") || before.ends_with("camera") || before.ends_with("view");
}

}  // namespace atelier
