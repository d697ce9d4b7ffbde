#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace atelier {

/// One field of an options struct, as `describe()` tells it.
struct OptionField {
  std::string name;  ///< snake_case; nested structs use dots: "solver.substeps"
  std::string help;  ///< what it is and when to change it, one sentence
  std::string unit;  ///< "m", "N/m", "px", "" for none
  std::variant<bool*, int*, std::int64_t*, double*, std::string*, std::vector<double>*> target;
  double min = -std::numeric_limits<double>::infinity();  ///< smallest allowed (each element)
  double max = std::numeric_limits<double>::infinity();   ///< largest allowed
  std::vector<std::string> choices;  ///< for strings: what is allowed; empty: anything
  bool keyed = true;  ///< false: does not change the result, so it is no part of a stage's key
};

/// The description of an options struct: what TOML, flags, `--help`, range checks, provenance and
/// docs/options.md are all made from. Every FOptions has, beside it,
/// `OptionTable describe(FOptions& options);` whose fields point into `options`.
struct OptionTable {
  std::vector<OptionField> fields;

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
  /// The fields of a nested struct, with "name." before theirs.
  OptionTable& add(const std::string& name, const OptionTable& nested);
  /// Marks the field added last as no part of a stage's key.
  OptionTable& not_keyed();
};

/// Sets one field from text ("true", "3", "0.5", "[1, 2]", "cuda"). Returns "" or what is wrong, in
/// one sentence with the allowed range or choices and, for an unknown name, the nearest known one.
std::string set_option(OptionTable& table, const std::string& name, const std::string& text);

/// The current value as text that `set_option` reads back to the same bits.
std::string option_text(const OptionField& field);

/// Every keyed field as JSON with sorted names and shortest round-trip numbers: the same options
/// give the same text. Part of a stage's key.
std::string canonical_json(const OptionTable& table);

/// Findings for values outside their ranges (also NaN) or choices.
std::vector<std::string> check_options(const OptionTable& table);

/// A Markdown table: name, default, range, unit, help.
std::string options_markdown(const OptionTable& table);

}  // namespace atelier
