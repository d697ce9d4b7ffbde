#include "core/nearest_name.h"

#include <algorithm>
#include <cstddef>

namespace atelier {
namespace {

constexpr std::size_t kLongestGuess = 256;  // longer is no name; keeps the cost bounded

std::size_t alignment_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> two_above(b.size() + 1);
  std::vector<std::size_t> above(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    above[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], two_above[j - 2] + 1);
      }
    }
    two_above.swap(above);
    above.swap(row);
  }
  return above[b.size()];
}

/// ASCII letters alone: no known name has others.
std::string lower_case(std::string_view name) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return lower;
}

/// "unit" of "--unit".
std::string_view without_dashes(std::string_view name) {
  return name.substr(std::min(name.find_first_not_of('-'), name.size()));
}

/// "unit" of "input.unit", "--input.unit" and "--unit".
std::string_view last_word(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  const std::size_t begin = dot == std::string_view::npos ? name.find_first_not_of('-') : dot + 1;
  return name.substr(std::min(begin, name.size()));
}

}  // namespace

std::string nearest_name(std::string_view typed, const std::vector<std::string>& known) {
  if (typed.empty() || typed.size() > kLongestGuess) {
    return "";
  }
  const std::string name = lower_case(typed);
  // By its letters it would be the cpu, which is what nobody means by it.
  if (name == "gpu" && std::find(known.begin(), known.end(), "cuda") != known.end()) {
    return "cuda";
  }
  std::string best;
  std::size_t best_distance = kLongestGuess;
  for (const std::string& candidate : known) {
    if (candidate.size() > kLongestGuess) {
      continue;
    }
    const std::size_t distance = alignment_distance(name, lower_case(candidate));
    // Dashes that all flags have make no two of them alike.
    const std::size_t length =
        std::max(without_dashes(name).size(), without_dashes(candidate).size());
    if (distance < best_distance && 3 * distance <= length) {
      best = candidate;
      best_distance = distance;
    }
  }
  if (!best.empty()) {
    return best;
  }
  const auto same_word =
      std::find_if(known.begin(), known.end(), [&](const std::string& candidate) {
        return lower_case(last_word(candidate)) == last_word(name);
      });
  return same_word == known.end() ? "" : *same_word;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& known) {
  const std::string near = nearest_name(name, known);
  return near.empty() ? "" : ", did you mean '" + near + "'?";
}

}  // namespace atelier
