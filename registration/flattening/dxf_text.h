#pragma once

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <set>
#include <string>

#include "core/types.h"

namespace atelier {

/// ASCII DXF R12 in millimetres: pairs of group code and value, a line each.
class DxfText {
 public:
  void pair(int code, const std::string& value) {
    char text[16];
    std::snprintf(text, sizeof text, "%3d", code);
    text_ += std::string(text) + "\r\n" + value + "\r\n";
  }
  void number(int code, double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.6f", value);
    std::string digits = text;
    std::replace(digits.begin(), digits.end(), ',', '.');
    pair(code, digits == "-0.000000" ? "0.000000" : digits);
  }
  void integer(int code, int value) {
    char text[16];
    std::snprintf(text, sizeof text, "%6d", value);
    pair(code, text);
  }
  /// Millimetres.
  void point(int code, const Eigen::Vector2d& metres) {
    number(code, metres.x() * 1000);
    number(code + 10, metres.y() * 1000);
    number(code + 20, 0);
  }
  /// Header variables that say millimetres. R12 has neither; its readers skip variables that they
  /// do not know, and later programs scale by $INSUNITS.
  void units() {
    pair(9, "$MEASUREMENT");  // metric: hatch and line types
    integer(70, 1);
    pair(9, "$INSUNITS");
    integer(70, 4);
  }
  void entity(const char* type, const char* layer) {
    pair(0, type);
    pair(8, layer);
  }
  void polyline(const Points2& line, bool closed, const char* layer) {
    entity("POLYLINE", layer);
    integer(66, 1);
    point(10, {0, 0});
    integer(70, closed ? 1 : 0);
    for (Index i = 0; i < line.rows(); ++i) {
      entity("VERTEX", layer);
      point(10, line.row(i).transpose());
    }
    entity("SEQEND", layer);
  }
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* layer) {
    entity("LINE", layer);
    point(10, a);
    point(11, b);
  }
  /// Begins a block, of which an insertion draws a copy.
  void block(const std::string& name, const char* layer) {
    entity("BLOCK", layer);
    pair(2, name);
    integer(70, 0);
    point(10, {0, 0});
  }
  void insert(const std::string& name, const char* layer) {
    entity("INSERT", layer);
    pair(2, name);
    point(10, {0, 0});
  }
  void label(const std::string& value, const Eigen::Vector2d& at, double height,
             const char* layer) {
    entity("TEXT", layer);
    point(10, at);
    number(40, height * 1000);
    pair(1, value);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

/// R12 names are letters, digits, "-", "_" and "$", at most 31; each once.
inline std::string dxf_block_name(const std::string& name, std::set<std::string>& taken) {
  std::string block;
  for (const char c : name.substr(0, 24)) {
    const auto u = static_cast<unsigned char>(c);
    block += u < 128 && std::isalnum(u) != 0 ? static_cast<char>(std::toupper(u)) : '_';
  }
  block = block.empty() ? "PIECE" : block;
  std::string unique = block;
  for (int i = 2; !taken.insert(unique).second; ++i) {
    unique = block + "-" + std::to_string(i);
  }
  return unique;
}

/// One line of plain ASCII.
inline std::string dxf_plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    result += u >= 32 && u < 127 ? c : '?';
  }
  return result;
}

/// Closed, of 100 mm, so that whoever opens a drawing can measure its unit: programs take
/// $INSUNITS, the text UNITS or neither.
inline constexpr double kControlSquare = 0.1;  // m
inline Points2 control_square(const Eigen::RowVector2d& corner) {
  Points2 square(4, 2);
  square << corner, corner + Eigen::RowVector2d(kControlSquare, 0),
      corner + Eigen::RowVector2d(kControlSquare, kControlSquare),
      corner + Eigen::RowVector2d(0, kControlSquare);
  return square;
}

}  // namespace atelier
