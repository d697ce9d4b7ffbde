#include "core/io/drawing_text.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include "core/error.h"
#include "core/io/plain_text.h"
#include "core/io/text_scanner.h"
#include "core/io/xml_elements.h"

namespace atelier {
namespace {

/// "210mm" is a finite length; "-3" and "wide" are none.
bool is_svg_length(std::string_view text) {
  for (const std::string_view unit :
       {"rem", "px", "mm", "cm", "in", "pt", "pc", "em", "ex", "vw", "vh", "Q", "%"}) {
    if (text.ends_with(unit)) {
      text.remove_suffix(unit.size());
      break;
    }
  }
  double value = 0;
  return parse_number(text, value) && value >= 0;
}

std::string svg_size(const XmlElement& root, const char* name, const std::string& file) {
  const auto said = root.attributes.find(name);
  if (said == root.attributes.end()) {
    return "";
  }
  const std::string_view text = trimmed_text(said->second);
  if (text != "auto" && !is_svg_length(text)) {
    throw DataError(file, "line " + std::to_string(root.line),
                    std::string(name) + " = " + in_quotes(said->second),
                    "a length of 0 or more, such as 210mm");
  }
  return std::string(text);
}

std::vector<double> svg_view_box(const XmlElement& root, const std::string& file) {
  const auto said = root.attributes.find("viewBox");
  if (said == root.attributes.end()) {
    return {};
  }
  std::string words = said->second;
  std::replace(words.begin(), words.end(), ',', ' ');
  std::replace(words.begin(), words.end(), '\n', ' ');
  TextScanner scanner(words, file, static_cast<std::int64_t>(words.size()) + 1);
  scanner.next_line();
  std::vector<double> box;
  bool numbers = true;
  for (std::string_view word = scanner.next_word(); !word.empty() && numbers;
       word = scanner.next_word()) {
    double value = 0;
    numbers = box.size() < 4 && parse_number(word, value);
    box.push_back(value);
  }
  if (!numbers || box.size() != 4 || box[2] < 0 || box[3] < 0) {
    throw DataError(file, "line " + std::to_string(root.line),
                    "viewBox = " + in_quotes(said->second),
                    "four finite numbers, the last two 0 or more");
  }
  return box;
}

/// "nan" or "inf" in whatever case: what printing a number that is not finite leaves.
bool says_not_finite(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower.find("nan") != std::string::npos || lower.find("inf") != std::string::npos;
}

constexpr const char* kSvgNumbers[] = {"d",  "points", "transform", "x",  "y",     "x1",
                                       "y1", "x2",     "y2",        "cx", "cy",    "r",
                                       "rx", "ry",     "dx",        "dy", "width", "height"};

/// Real numbers by their group code (DXF reference, "Group code value types").
bool is_dxf_real(std::int64_t code) {
  return (code >= 10 && code <= 59) || (code >= 110 && code <= 149) ||
         (code >= 210 && code <= 239) || (code >= 460 && code <= 469) ||
         (code >= 1010 && code <= 1059);
}

/// Whole numbers by it.
bool is_dxf_integer(std::int64_t code) {
  return (code >= 60 && code <= 99) || (code >= 160 && code <= 179) ||
         (code >= 270 && code <= 299) || (code >= 370 && code <= 389) ||
         (code >= 400 && code <= 409) || (code >= 420 && code <= 429) ||
         (code >= 440 && code <= 459) || (code >= 1060 && code <= 1071);
}

const char* dxf_unit(std::int64_t number) {
  constexpr const char* kUnits[] = {"", "in", "ft", "mi", "mm", "cm", "m"};
  return number >= 0 && number < std::ssize(kUnits) ? kUnits[number] : "";
}

}  // namespace

SvgDrawing parse_svg(std::string_view text, const std::string& file, const Limits& limits) {
  check_plain_text(text, file);
  if (text.find("<svg") == std::string_view::npos && text.find(":svg") == std::string_view::npos) {
    throw DataError(file, "beginning", beginning_of(text), "a drawing, <svg ...>");
  }
  Limits of_values = limits;  // a path may be long
  of_values.text_string_bytes = limits.text_file_bytes;
  const std::vector<XmlElement> elements = parse_xml_elements(text, file, of_values);
  const XmlElement& root = elements.front();
  if (root.name != "svg" && !root.name.ends_with(":svg")) {
    throw DataError(file, "line " + std::to_string(root.line),
                    "<" + root.name.substr(0, 40) + "> as root", "a drawing, <svg ...>");
  }
  SvgDrawing drawing;
  drawing.width = svg_size(root, "width", file);
  drawing.height = svg_size(root, "height", file);
  drawing.view_box = svg_view_box(root, file);
  drawing.elements = static_cast<std::int64_t>(elements.size());
  const std::string space =
      root.name == "svg" ? "xmlns" : "xmlns:" + root.name.substr(0, root.name.size() - 4);
  const auto said = root.attributes.find(space);
  if (said == root.attributes.end() || said->second != "http://www.w3.org/2000/svg") {
    drawing.findings.push_back(
        {Severity::Warning, "svg-name-space", "line " + std::to_string(root.line),
         "the root is not in SVG's",
         "xmlns=\"http://www.w3.org/2000/svg\"; browsers show the text of it"});
  }
  for (const XmlElement& element : elements) {
    for (const char* name : kSvgNumbers) {
      const auto number = element.attributes.find(name);
      if (number != element.attributes.end() && says_not_finite(number->second)) {
        drawing.findings.push_back(
            {Severity::Error, "svg-not-finite", "line " + std::to_string(element.line),
             "a number of <" + element.name.substr(0, 40) + "> in " + name + " is not finite",
             "write the drawing again: it is drawn up to there"});
        return drawing;  // the first says enough
      }
    }
  }
  return drawing;
}

DxfDrawing parse_dxf(std::string_view text, const std::string& file, const Limits& limits) {
  if (text.starts_with("AutoCAD Binary DXF")) {
    throw DataError(file, "beginning", "a binary DXF", "a text DXF: 0, then SECTION");
  }
  check_plain_text(text, file);
  if (trimmed_text(text).empty()) {
    throw DataError(file, "beginning", beginning_of(text), "a text DXF: 0, then SECTION");
  }
  TextScanner scanner(text, file, limits.line_bytes);
  DxfDrawing drawing;
  bool open = false;
  std::string variable;  // of the header, whose value comes next
  for (;;) {
    if (!scanner.next_line()) {
      scanner.fail("the end of the text",
                   open ? "0 ENDSEC of section " + drawing.sections.back() : "0 EOF");
    }
    std::int64_t code = 0;
    const std::string_view number = scanner.rest();
    if (!parse_integer(number, code) || code < -5 || code > 1071) {
      scanner.fail(in_quotes(number), "a group code, -5 to 1071");
    }
    if (!scanner.next_line()) {
      scanner.fail("group code " + std::to_string(code) + " at the end of the text",
                   "its value in a line of its own");
    }
    const std::string_view value = scanner.rest();
    if (code == 999) {  // a comment
      continue;
    }
    double real = 0;
    std::int64_t integer = 0;
    if (is_dxf_real(code) && !parse_number(value, real)) {
      scanner.fail(in_quotes(value),
                   "a finite number, as group code " + std::to_string(code) + " says");
    }
    if (is_dxf_integer(code) && !parse_integer(value, integer)) {
      scanner.fail(in_quotes(value),
                   "a whole number, as group code " + std::to_string(code) + " says");
    }
    if (!open) {
      if (code == 0 && value == "EOF") {
        break;
      }
      if (code != 0 || value != "SECTION") {
        scanner.fail(
            "group code " + std::to_string(code) + " " + in_quotes(value),
            drawing.sections.empty() ? "a text DXF: 0, then SECTION" : "0 SECTION or 0 EOF");
      }
      const bool named = scanner.next_line() && scanner.rest() == "2" && scanner.next_line();
      drawing.sections.emplace_back(named ? scanner.rest().substr(0, 80) : "");
      if (drawing.sections.back().empty()) {
        scanner.fail("a section without a name", "2 and its name behind 0 SECTION");
      }
      open = true;
    } else if (code == 0 && value == "ENDSEC") {
      open = false;
    } else if (code == 0 && (value == "SECTION" || value == "EOF")) {
      scanner.fail("0 " + std::string(value) + " inside of section " + drawing.sections.back(),
                   "0 ENDSEC before it");
    } else if (code == 0 && value.empty()) {
      scanner.fail("group code 0 without a type", "what begins here");
    } else if (code == 0 && drawing.sections.back() == "ENTITIES") {
      ++drawing.entities[std::string(value.substr(0, 40))];
    } else if (drawing.sections.back() == "HEADER") {
      drawing.version = variable == "$ACADVER" && code == 1 ? value.substr(0, 40) : drawing.version;
      drawing.unit = variable == "$INSUNITS" && code == 70 ? dxf_unit(integer) : drawing.unit;
      variable = code == 9 ? value : variable;
    }
  }
  while (scanner.next_line()) {
    if (const std::string_view behind = scanner.rest(); !behind.empty()) {
      scanner.fail(in_quotes(behind), "nothing behind 0 EOF");
    }
  }
  if (drawing.sections.empty()) {
    scanner.fail("0 EOF", "a text DXF: 0, then SECTION");
  }
  return drawing;
}

}  // namespace atelier
