#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/options.h"

namespace atelier {

// Constraints between options of one table. Rules name options by the ends of their names: in the
// table of a run, "track.rounds" is the "rounds" of a rule, beside the other options of "track.". A
// table that lacks one of a rule's options need not keep it. Every value is in its own range.

/// Of two numbers.
struct OrderRule {
  std::string_view first;
  std::string_view second;
  bool (*holds)(double first, double second);
  std::string_view wanted;  ///< "it takes less than that"
};

/// The first less than the second.
bool is_less(double first, double second);
inline constexpr std::string_view kTakesLess = "it takes less than that";

/// Options that have no effect while others have these values.
struct IdleRule {
  struct Value {
    std::string_view option;
    std::string_view text;
    bool other = false;  ///< any text but this
  };
  std::string_view option;         ///< one that ends in "." is a section
  std::array<Value, 2> idle_with;  ///< the second may be empty
  std::string_view wanted;         ///< flags that make it count: "more --rounds"
  bool unless_said = false;  ///< said to be off by hand, the rest stays as it is: a comparison
};

/// A text that another option's value asks for.
struct NeededRule {
  std::string_view option;
  IdleRule::Value asked_by;
  std::string_view wanted;  ///< "--region: a vertex group of the body"
};

/// The rules of a stage, or of several that take the same options. Commands that take these, too,
/// keep to them as well.
struct OptionRules {
  std::span<const OrderRule> order = {};
  std::span<const IdleRule> idle = {};
  std::span<const NeededRule> needed = {};
  /// Further constraints: a sentence for each violation. Null: none.
  std::vector<std::string> (*others)(const OptionTable& table) = nullptr;
};

/// The rules that a table violates, a sentence for each, with the options' names.
std::vector<std::string> broken_rules(const OptionTable& table, const OptionRules& rules);

// For `others`.

/// Whether a flag or a file set it.
bool is_said(const OptionField& field);

/// The prefix of a name before its end: "material." of "material.search.stretch_low" and
/// "search.stretch_low"; nothing where it ends otherwise. An `end` with a "." at its own end is any
/// option of that section.
std::optional<std::string> start_of(const std::string& name, std::string_view end);

/// The field of that very name, or null.
const OptionField* field_named(const OptionTable& table, const std::string& name);

/// The value of a field that is a number.
std::optional<double> number_of(const OptionField& field);

}  // namespace atelier
