#include "core/store/toml_entries.h"

#include <array>
#include <charconv>
#include <cstdio>

#include <toml++/toml.h>

#include "core/error.h"
#include "core/io/toml.h"
#include "core/limits.h"

namespace atelier {
namespace {

std::string place(const toml::source_region& region) {
  return "line " + std::to_string(region.begin.line) + ", column " +
         std::to_string(region.begin.column);
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

class Flattener {
 public:
  explicit Flattener(const std::string& file) : file_(file) {}

  void add(const std::string& name, const toml::node& node, std::int64_t depth) {
    if (depth > limits_.text_depth) {
      throw DataError(file_, place(node.source()),
                      "nesting deeper than " + std::to_string(limits_.text_depth), "flatter TOML");
    }
    if (const toml::table* table = node.as_table()) {
      for (const auto& [key, value] : *table) {
        const std::string word(key.str());
        add(name.empty() ? word : name + "." + word, value, depth + 1);
      }
      return;
    }
    const toml::array* array = node.as_array();
    if (array != nullptr && !array->empty() && array->is_homogeneous(toml::node_type::table)) {
      for (std::size_t i = 0; i < array->size(); ++i) {
        add(name + "." + std::to_string(i), (*array)[i], depth + 1);
      }
      return;
    }
    TomlEntry entry;
    entry.name = name;
    entry.line = static_cast<std::int64_t>(node.source().begin.line);
    set_value(entry, node, depth);
    if (static_cast<std::int64_t>(entry.text.size()) > limits_.line_bytes) {
      throw DataError(file_, place(node.source()),
                      "a value of " + std::to_string(entry.text.size()) + " bytes",
                      "at most " + std::to_string(limits_.line_bytes));
    }
    entries_.push_back(std::move(entry));
  }

  std::vector<TomlEntry> take() { return std::move(entries_); }

 private:
  void set_value(TomlEntry& entry, const toml::node& node, std::int64_t depth) const {
    if (const auto* flag = node.as_boolean()) {
      entry.kind = TomlEntry::Kind::Boolean;
      entry.text = flag->get() ? "true" : "false";
    } else if (const auto* integer = node.as_integer()) {
      entry.kind = TomlEntry::Kind::Number;
      entry.text = std::to_string(integer->get());
    } else if (const auto* number = node.as_floating_point()) {
      entry.kind = TomlEntry::Kind::Number;
      entry.text = number_text(number->get());
    } else if (const auto* text = node.as_string()) {
      entry.kind = TomlEntry::Kind::Text;
      entry.text = text->get();
    } else if (const auto* date = node.as_date()) {
      char day[40];
      std::snprintf(day, sizeof day, "%04u-%02u-%02u", static_cast<unsigned>(date->get().year),
                    static_cast<unsigned>(date->get().month),
                    static_cast<unsigned>(date->get().day));
      entry.kind = TomlEntry::Kind::Date;
      entry.text = day;
    } else if (const auto* array = node.as_array()) {
      check_depth(*array, depth);
      entry.kind = TomlEntry::Kind::Numbers;
      entry.text = "[";
      for (const toml::node& item : *array) {
        if (!item.is_number()) {
          entry.kind = TomlEntry::Kind::Other;
          entry.text.clear();
          return;
        }
        TomlEntry element;
        set_value(element, item, depth);
        entry.text += (entry.text.size() > 1 ? ", " : "") + element.text;
      }
      entry.text += "]";
    }
  }

  void check_depth(const toml::array& array, std::int64_t depth) const {
    if (depth > limits_.text_depth) {
      throw DataError(file_, place(array.source()),
                      "nesting deeper than " + std::to_string(limits_.text_depth), "flatter TOML");
    }
    for (const toml::node& item : array) {
      if (const toml::array* nested = item.as_array()) {
        check_depth(*nested, depth + 1);
      }
    }
  }

  const std::string& file_;
  Limits limits_;
  std::vector<TomlEntry> entries_;
};

}  // namespace

std::vector<TomlEntry> read_toml_entries(std::string_view text, const std::string& file) {
  check_toml_nesting(text, file);
  try {
    const toml::table table = toml::parse(text);
    Flattener flattener(file);
    flattener.add("", table, 0);
    return flattener.take();
  } catch (const toml::parse_error& error) {
    throw DataError(file, place(error.source()), std::string(error.description()), "TOML 1.0");
  }
}

}  // namespace atelier
