#include "capture/worn_labels.h"

#include <algorithm>
#include <array>
#include <optional>

#include "core/error.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr const char* kWornNames =
    "names of labels of what is worn: upper, lower, dress, outer, shoes, other";

/// The labels of a comma-separated list; returns the name that is none of what is worn, or "".
std::string read_labels(const std::string& list, std::vector<Label>& labels) {
  // Skin says where the body is, and hair counts for nothing anyway.
  constexpr std::array kWorn = {Label::Upper, Label::Lower, Label::Dress,
                                Label::Outer, Label::Shoes, Label::Other};
  std::string rest = list;
  while (!rest.empty()) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::size_t begin = std::min(rest.find_first_not_of(' '), comma);
    std::string name = rest.substr(begin, comma - begin);
    name.erase(name.find_last_not_of(' ') + 1);
    rest = comma < rest.size() ? rest.substr(comma + 1) : "";
    const std::optional<Label> label = label_of(name);
    if (!label || std::find(kWorn.begin(), kWorn.end(), *label) == kWorn.end()) {
      return "'" + name.substr(0, 40) + "'";
    }
    labels.push_back(*label);
  }
  return "";
}

}  // namespace

std::string excluded_problem(const std::string& list) {
  std::vector<Label> labels;
  const std::string wrong = read_labels(list, labels);
  return wrong.empty() ? "" : wrong + "; it takes " + kWornNames;
}

std::vector<Label> labels_of(const std::string& list) {
  std::vector<Label> labels;
  if (const std::string wrong = read_labels(list, labels); !wrong.empty()) {
    throw UnknownValue("", "excluded", list, kWornNames);
  }
  return labels;
}

}  // namespace atelier
