#include "bodymodel/formats/tailor_measurements.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/lower_extension.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/io/xml_elements.h"
#include "core/printable.h"

namespace atelier {
namespace {

constexpr double kMostLength = 100;  // m

struct Formula {
  std::string text;
  std::int64_t line = 0;
};

/// Values of formulas that name each other, in the file's unit.
class Formulas {
 public:
  Formulas(const std::map<std::string, Formula>& all, std::int64_t depth)
      : all_(all), most_(depth) {}

  /// Nothing for what is no formula of ours, or leads to one.
  std::optional<double> value(const std::string& name) {
    if (const auto known = values_.find(name); known != values_.end()) {
      return known->second;
    }
    const auto found = all_.find(name);
    if (found == all_.end()) {
      return std::nullopt;
    }
    values_[name] = std::nullopt;  // what a formula is of itself
    Text text{found->second.text};
    std::optional<double> result = sum(text);
    skip_blanks(text);
    if (!text.rest.empty() || (result && !std::isfinite(*result))) {
      result.reset();
    }
    return values_[name] = result;
  }

 private:
  struct Text {
    std::string_view rest;
  };

  static void skip_blanks(Text& text) {
    while (!text.rest.empty() && (text.rest.front() == ' ' || text.rest.front() == '\t')) {
      text.rest.remove_prefix(1);
    }
  }

  /// The next character if it is one of these, else 0.
  static char take(Text& text, std::string_view any) {
    skip_blanks(text);
    if (text.rest.empty() || any.find(text.rest.front()) == std::string_view::npos) {
      return 0;
    }
    const char c = text.rest.front();
    text.rest.remove_prefix(1);
    return c;
  }

  std::optional<double> sum(Text& text) {
    std::optional<double> left = product(text);
    while (const char sign = left ? take(text, "+-") : '\0') {
      const std::optional<double> right = product(text);
      left = right ? std::optional(sign == '+' ? *left + *right : *left - *right) : std::nullopt;
    }
    return left;
  }

  std::optional<double> product(Text& text) {
    std::optional<double> left = power(text);
    while (const char sign = left ? take(text, "*/") : '\0') {
      const std::optional<double> right = power(text);
      left = right ? std::optional(sign == '*' ? *left * *right : *left / *right) : std::nullopt;
    }
    return left;
  }

  std::optional<double> power(Text& text) {
    if (++depth_ > most_) {
      --depth_;
      return std::nullopt;
    }
    std::optional<double> result;
    if (const char sign = take(text, "+-")) {
      const std::optional<double> of = power(text);
      result = of ? std::optional(sign == '-' ? -*of : *of) : std::nullopt;
    } else {
      result = atom(text);
      if (result && take(text, "^") != 0) {
        const std::optional<double> exponent = power(text);
        result = exponent ? std::optional(std::pow(*result, *exponent)) : std::nullopt;
      }
    }
    --depth_;
    return result;
  }

  std::optional<double> atom(Text& text) {
    if (take(text, "(") != 0) {
      const std::optional<double> inner = sum(text);
      return take(text, ")") != 0 ? inner : std::nullopt;
    }
    skip_blanks(text);
    const std::size_t end = std::min(text.rest.find_first_of(" \t+-*/^()"), text.rest.size());
    const std::string word(text.rest.substr(0, end));
    text.rest.remove_prefix(end);
    double number = 0;
    if (parse_number(word, number)) {
      return number;
    }
    return value(word);
  }

  const std::map<std::string, Formula>& all_;
  std::map<std::string, std::optional<double>> values_;
  std::int64_t most_;
  std::int64_t depth_ = 0;
};

double metres_per_unit(const XmlElement& unit, const std::string& file) {
  for (const auto& [name, metres] :
       {std::pair("mm", 0.001), std::pair("cm", 0.01), std::pair("inch", 0.0254)}) {
    if (unit.text == name) {
      return metres;
    }
  }
  throw DataError(file, "line " + std::to_string(unit.line),
                  "the unit " + in_quotes(unit.text.substr(0, 40)), "mm, cm or inch");
}

void require_individual(const XmlElement& root, const std::string& file) {
  if (root.name == "vst" || root.name == "smms") {
    throw DataError(file, "line " + std::to_string(root.line), "a table of sizes",
                    "the measurements of one person: save those of a size as .vit or .smis");
  }
  if (root.name != "vit" && root.name != "smis") {
    throw DataError(file, "line " + std::to_string(root.line), "<" + root.name.substr(0, 40) + ">",
                    "<vit> of Valentina or <smis> of Seamly2D");
  }
}

Formula formula_of(const XmlElement& element, const std::string& file) {
  for (const char* key : {"name", "value"}) {
    const auto found = element.attributes.find(key);
    if (found == element.attributes.end() || (*key == 'n' && found->second.empty())) {
      throw DataError(file, "line " + std::to_string(element.line),
                      "a measurement without " + std::string(key), "both name and value");
    }
  }
  return {element.attributes.at("value"), element.line};
}

}  // namespace

TailorMeasurements parse_tailor_measurements(std::string_view text, const std::string& file,
                                             const Limits& limits) {
  if (text.empty()) {
    throw DataError(file, "", "an empty file", "measurements of Valentina or Seamly2D");
  }
  const std::vector<XmlElement> elements = parse_xml_elements(text, file, limits);
  require_individual(elements.front(), file);
  TailorMeasurements result;
  result.file = file;
  double metres = 0;
  std::map<std::string, Formula> formulas;
  for (const XmlElement& element : elements) {
    if (element.name == "unit" && element.depth == 1) {
      metres = metres_per_unit(element, file);
      result.unit = element.text;
    }
    const auto type = element.attributes.find("type");
    const bool separator = type != element.attributes.end() && type->second == "separator";
    if (element.name != "m" || separator) {  // one is a title between measurements
      continue;
    }
    Formula formula = formula_of(element, file);
    const std::string& name = element.attributes.at("name");
    if (!formulas.emplace(name, std::move(formula)).second) {
      throw DataError(file, "line " + std::to_string(element.line),
                      in_quotes(name.substr(0, 40)) + " a second time", "each measurement once");
    }
  }
  if (metres == 0) {
    throw DataError(file, "unit", "no unit", "<unit>mm</unit>, cm or inch");
  }
  if (formulas.empty()) {
    throw DataError(file, "", "no measurement", "<m name=\"height\" value=\"172\"/> and others");
  }
  Formulas all(formulas, limits.text_depth);
  for (const auto& [name, formula] : formulas) {
    const std::optional<double> value = all.value(name);
    if (!value) {
      result.findings.push_back(
          {Severity::Warning, "measurement-formula",
           file + ", line " + std::to_string(formula.line),
           name.substr(0, 40) + " is " + in_quotes(formula.text.substr(0, 80)),
           "left out: write a number, or + - * / ^ over measurements"});
      continue;
    }
    if (std::abs(*value * metres) > kMostLength) {
      throw DataError(file, "line " + std::to_string(formula.line),
                      name.substr(0, 40) + " of " + number_text(*value * metres) + " m",
                      "at most " + number_text(kMostLength) + " m");
    }
    if (*value != 0) {
      result.lengths[name] = *value * metres;
    }
  }
  return result;
}

TailorMeasurements read_tailor_measurements(const std::filesystem::path& path,
                                            const Limits& limits) {
  return parse_tailor_measurements(read_file_text(path, limits.text_file_bytes), path.string(),
                                   limits);
}

bool has_measurements_extension(const std::string& file) {
  const std::string extension = lower_extension(file);
  return extension == ".vit" || extension == ".smis" || extension == ".vst" || extension == ".smms";
}

namespace {

// By the same definition.
constexpr std::pair<const char*, double DefaultHumanOptions::*> kSame[] = {
    {"height", &DefaultHumanOptions::stature},
    {"leg_crotch_to_floor", &DefaultHumanOptions::leg_length},
    {"arm_shoulder_tip_to_wrist", &DefaultHumanOptions::arm_length},
    {"width_shoulder", &DefaultHumanOptions::shoulder_breadth},
    {"neck_mid_circ", &DefaultHumanOptions::neck_girth},
    {"bust_circ", &DefaultHumanOptions::chest_girth},
    {"waist_circ", &DefaultHumanOptions::waist_girth},
    {"hip_circ", &DefaultHumanOptions::hip_girth},
    {"leg_thigh_upper_circ", &DefaultHumanOptions::thigh_girth}};

}  // namespace

std::string unlikely_measurement(const TailorMeasurements& measurements) {
  for (const auto& [name, option] : kSame) {
    if (const auto found = measurements.lengths.find(name); found != measurements.lengths.end()) {
      DefaultHumanOptions human;
      human.*option = found->second;
      if (const std::string problem = human_options_problem(human); !problem.empty()) {
        std::array<char, 32> metres{};
        std::snprintf(metres.data(), metres.size(), "%.4g", found->second);
        return std::string(name) + " is " + metres.data() + " m, in " + measurements.unit +
               " as the file says: " + problem;
      }
    }
  }
  return "";
}

DefaultHumanOptions with_measurements(DefaultHumanOptions human, TailorMeasurements& measurements) {
  if (const std::string unlikely = unlikely_measurement(measurements); !unlikely.empty()) {
    throw DataError(measurements.file, "", unlikely, "<unit> as the numbers were taken");
  }
  std::string taken;
  for (const auto& [name, option] : kSame) {
    if (const auto found = measurements.lengths.find(name); found != measurements.lengths.end()) {
      human.*option = found->second;
      taken += (taken.empty() ? "" : ", ") + std::string(name);
    }
  }
  measurements.findings.push_back(
      {taken.empty() ? Severity::Warning : Severity::Note, "measurements-taken", "",
       taken.empty() ? "no measurement that the body knows" : "the body takes " + taken,
       "others follow from these"});
  return human;
}

}  // namespace atelier
