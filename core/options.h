#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace atelier {

/// An enumeration behind a field: its value as an index into `OptionField::choices`.
struct OptionEnum {
  std::function<std::size_t()> get;
  std::function<void(std::size_t)> set;
};

/// Type and address of a field's value.
using OptionTarget = std::variant<bool*, int*, std::int64_t*, double*, std::string*,
                                  std::vector<double>*, OptionEnum>;

/// One field of an options struct, as `describe()` tells it.
struct OptionField {
  std::string name;  ///< snake_case; nested structs use dots: "solver.substeps"
  std::string help;  ///< what it is and when to change it, one sentence
  std::string unit;  ///< "m", "N/m", "px", "" for none
  OptionTarget target;
  double min = -std::numeric_limits<double>::infinity();  ///< smallest allowed (each element)
  double max = std::numeric_limits<double>::infinity();   ///< largest allowed
  std::vector<std::string> choices{};  ///< for strings: what is allowed; empty: anything
  bool keyed = true;  ///< false: does not change the result, so it is no part of a stage's key
  std::string source = "default";  ///< who set the value: "default", "flag" or "<file>:<line>"
};

/// The description of an options struct: what TOML, flags, `--help`, range checks, provenance and
/// docs/reference/options.md are all made from. Every FOptions has, beside it,
/// `OptionTable describe(FOptions& options);` whose fields point into `options`. Every `add` throws
/// LogicError for a name that is not lower_case words joined by dots or is there twice, for a
/// missing help and for an empty range. A help is shown with a capital and without a full stop.
struct OptionTable {
  std::vector<OptionField> fields;
  /// One sentence for each former name or value that `set_option` understood: "least_views is now
  /// min_views". The caller that sets options shows them.
  std::vector<std::string> notices;

  OptionTable& add(std::string name, bool& target, std::string help);
  OptionTable& add(std::string name, int& target, double min, double max, std::string unit,
                   std::string help);
  OptionTable& add(std::string name, std::int64_t& target, double min, double max, std::string unit,
                   std::string help);
  OptionTable& add(std::string name, double& target, double min, double max, std::string unit,
                   std::string help);
  OptionTable& add(std::string name, std::vector<double>& target, double min, double max,
                   std::string unit, std::string help);
  OptionTable& add(std::string name, std::string& target, std::vector<std::string> choices,
                   std::string help);
  /// An enumeration, by the name of each value: add("device", options.device,
  /// {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}}, "...").
  template <class Enum>
  OptionTable& add(std::string name, Enum& target, std::vector<std::pair<std::string, Enum>> values,
                   std::string help) {
    std::vector<std::string> names;
    names.reserve(values.size());
    for (const auto& value : values) {
      names.push_back(value.first);
    }
    OptionEnum access;
    access.get = [&target, values] {
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (values[i].second == target) {
          return i;
        }
      }
      return values.size();
    };
    access.set = [&target, values](std::size_t i) { target = values[i].second; };
    return add_enum(std::move(name), std::move(access), std::move(names), std::move(help));
  }
  /// The fields of a nested struct, with "name." before theirs.
  OptionTable& add(const std::string& name, const OptionTable& nested);
  /// The fields of another struct under their own names.
  OptionTable& add(const OptionTable& others);
  /// Marks the field added last as no part of a stage's key.
  OptionTable& not_keyed();

 private:
  OptionTable& add_enum(std::string name, OptionEnum target, std::vector<std::string> choices,
                        std::string help);
  OptionTable& add_ranged(std::string name, OptionTarget target, double min, double max,
                          std::string unit, std::string help);
  OptionTable& add_chosen(std::string name, OptionTarget target, std::vector<std::string> choices,
                          std::string help);
  OptionTable& append(OptionField field);
};

/// An options struct behind its table, so that its owner need not know the struct's type.
struct OptionSet {
  std::shared_ptr<void> values;
  OptionTable table;  ///< points into `values`
};

/// The defaults of `Options`, which has `describe(Options&)` beside it. The row of a stage or a
/// command names `option_set<ItsOptions>`.
template <class Options>
OptionSet option_set() {
  auto values = std::make_shared<Options>();
  OptionTable table = describe(*values);
  return {std::move(values), std::move(table)};
}

/// The struct of a set made by `option_set<Options>`.
template <class Options>
const Options& options_of(const OptionSet& set) {
  return *static_cast<const Options*>(set.values.get());
}

/// Sets one field from text ("true", "3", "0.5", "[1, 2]", "cuda") and notes who set it. Returns ""
/// or what is wrong, in one sentence with the allowed range or choices and, for an unknown name,
/// the nearest known one; the field then keeps its value. Former names and values of what was
/// renamed (core/renamed_options.h) are understood, with a notice in `table.notices`. Numbers are
/// read in the C locale, the whole text must be used, and NaN and infinity are refused.
std::string set_option(OptionTable& table, const std::string& name, const std::string& text,
                       const std::string& source = "flag");

/// The current value as text that `set_option` reads back to the same bits.
std::string option_text(const OptionField& field);

/// The current value as JSON: true, 3, 0.5, [1,2], "cuda". Throws LogicError for NaN and infinity.
std::string option_json(const OptionField& field);

/// Values that a field accepts: "true|false", "integer in [1, 100]", "cpu|cuda", "list of number >
/// 0".
std::string option_range(const OptionField& field);

/// Every keyed field as JSON with sorted names and shortest round-trip numbers: the same options
/// give the same text. Part of a stage's key.
std::string canonical_json(const OptionTable& table);

/// One sentence for each value outside its range (also NaN) or choices; empty if all is well.
std::vector<std::string> check_options(const OptionTable& table);

/// A Markdown table: name, default (the current value), range, unit, help.
std::string options_markdown(const OptionTable& table);

/// The same as indented lines for `--help`.
std::string options_help(const OptionTable& table);

}  // namespace atelier
