#include "core/options_reference.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <tuple>
#include <utility>

namespace atelier {
namespace {

/// Where options are: the index of the owner, and the prefix of their names ("input.capture", "").
using OptionPlace = std::pair<std::size_t, std::string>;

/// Options that are the same in several places, in the order of the first of these.
struct CommonGroup {
  std::vector<OptionPlace> places;
  std::vector<std::vector<const OptionField*>> rows;  ///< of each option: its field in each place
  std::string name;                                   ///< the prefix that is shown, or ""
  std::string heading;
};

std::string prefix_of(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

std::string last_word(const std::string& name) {
  return name.substr(name.rfind('.') + 1);
}

/// "a", "b" and "c", each in the quotes of code.
std::string enumerated(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + ("`" + words[i] + "`");
  }
  return text;
}

/// The last word of the prefix that most places have, of several the shortest; "" only where no
/// place has one.
std::string shown_prefix(const std::vector<OptionPlace>& places) {
  std::map<std::string, std::size_t> counts;
  for (const OptionPlace& place : places) {
    ++counts[place.second];
  }
  if (counts.size() > 1) {
    counts.erase("");
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
        return a.second != b.second ? a.second < b.second : a.first.size() > b.first.size();
      });
  return last_word(most->first);
}

/// The value that most places have by default, of several the first.
const OptionField* usual_field(const std::vector<const OptionField*>& row) {
  const auto count = [&](const OptionField* field) {
    return std::count_if(row.begin(), row.end(), [&](const OptionField* other) {
      return option_text(*other) == option_text(*field);
    });
  };
  return *std::max_element(row.begin(), row.end(),
                           [&](const auto* a, const auto* b) { return count(a) < count(b); });
}

std::vector<CommonGroup> common_groups(const std::vector<OptionOwner>& owners) {
  using Signature = std::tuple<std::string, std::string, std::string, std::string, bool>;
  std::map<Signature, std::vector<std::pair<OptionPlace, const OptionField*>>> same;
  std::vector<Signature> order;
  for (std::size_t owner = 0; owner < owners.size(); ++owner) {
    for (const OptionField& field : owners[owner].table.fields) {
      Signature signature{last_word(field.name), option_range(field), field.unit, field.help,
                          field.keyed};
      auto& found = same[signature];
      if (found.empty()) {
        order.push_back(std::move(signature));
      }
      found.push_back({{owner, prefix_of(field.name)}, &field});
    }
  }
  std::vector<CommonGroup> groups;
  for (const Signature& signature : order) {
    std::vector<OptionPlace> places;
    std::vector<const OptionField*> row;
    for (const auto& [place, field] : same[signature]) {
      places.push_back(place);
      row.push_back(field);
    }
    if (places.size() < 2) {
      continue;
    }
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const CommonGroup& g) { return g.places == places; });
    if (group == groups.end()) {
      group = groups.insert(groups.end(), CommonGroup{places, {}, shown_prefix(places), ""});
    }
    group->rows.push_back(std::move(row));
  }
  std::erase_if(groups, [](const CommonGroup& group) { return group.rows.size() < 2; });
  std::map<std::string, int> uses;
  for (CommonGroup& group : groups) {
    std::vector<std::string> names;
    for (const OptionPlace& place : group.places) {
      names.push_back(owners[place.first].name);
    }
    group.heading =
        group.name.empty() ? "Options of " + enumerated(names) : "`" + group.name + ".*`";
    const int use = ++uses[group.heading];
    group.heading += use > 1 ? " (" + std::to_string(use) + ")" : "";
  }
  return groups;
}

/// The anchor that Markdown makes of a heading.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    if (c == ' ') {
      anchor += '-';
    } else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_') {
      anchor += c;
    } else if (c >= 'A' && c <= 'Z') {
      anchor += static_cast<char>(c - 'A' + 'a');
    }
  }
  return anchor;
}

std::string common_section(const CommonGroup& group, const std::vector<OptionOwner>& owners) {
  std::string text = "\n### " + group.heading + "\n\n";
  if (!group.name.empty()) {
    std::vector<std::string> names;
    for (const auto& [owner, prefix] : group.places) {
      names.push_back(owners[owner].name);
    }
    text += "Of " + enumerated(names) + ".\n\n";
  }
  OptionTable table;
  for (const auto& row : group.rows) {
    OptionField field = *usual_field(row);
    field.name = (group.name.empty() ? "" : group.name + ".") + last_word(field.name);
    table.fields.push_back(std::move(field));
  }
  return text + options_markdown(table);
}

/// The line of an owner's section that stands for its options of a group in one place.
std::string reference_line(const CommonGroup& group, std::size_t place) {
  const std::string& prefix = group.places[place].second;
  std::string shown = prefix.empty() ? "" : "`" + prefix + ".*`";
  if (prefix.empty()) {
    std::vector<std::string> names;
    for (const auto& row : group.rows) {
      names.push_back(row[place]->name);
    }
    shown = enumerated(names);
  }
  std::string text = "- " + shown + ": [" + group.heading + "](#" + anchor_of(group.heading) + ")";
  std::string differing;
  for (const auto& row : group.rows) {
    const std::string value = option_text(*row[place]);
    if (value != option_text(*usual_field(row))) {
      differing += (differing.empty() ? "; default here: `" : ", `") + row[place]->name + "` " +
                   (value.empty() ? "none" : "`" + value + "`");
    }
  }
  return text + differing + "\n";
}

}  // namespace

std::string options_reference(const std::vector<OptionOwner>& owners) {
  const std::vector<CommonGroup> groups = common_groups(owners);
  std::string text;
  if (!groups.empty()) {
    text +=
        "\n## Common options\n\nTaken by several stages and commands, each under the prefix that "
        "its own section says.\n";
  }
  for (const CommonGroup& group : groups) {
    text += common_section(group, owners);
  }
  for (std::size_t owner = 0; owner < owners.size(); ++owner) {
    text += "\n## atelier " + owners[owner].name + "\n\n";
    std::vector<const OptionField*> elsewhere;
    std::string lines;
    for (const CommonGroup& group : groups) {
      for (std::size_t place = 0; place < group.places.size(); ++place) {
        if (group.places[place].first == owner) {
          lines += reference_line(group, place);
          for (const auto& row : group.rows) {
            elsewhere.push_back(row[place]);
          }
        }
      }
    }
    OptionTable own;
    for (const OptionField& field : owners[owner].table.fields) {
      if (std::find(elsewhere.begin(), elsewhere.end(), &field) == elsewhere.end()) {
        own.fields.push_back(field);
      }
    }
    text += lines;
    text += own.fields.empty() ? "" : (lines.empty() ? "" : "\n") + options_markdown(own);
  }
  return text;
}

}  // namespace atelier
