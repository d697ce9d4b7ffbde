#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace atelier {

/// A line of a plot; all values above 0.
struct LogLine {
  std::string name;
  std::string colour;  ///< as SVG has it
  bool dashed = false;
  std::vector<double> y;
};

/// Writes lines over common values `x` (increasing), both axes logarithmic, as an SVG of 720 x 420.
/// Throws std::runtime_error where it cannot be written.
inline void write_log_plot(const std::string& file, const std::string& x_title,
                           const std::string& y_title, const std::vector<double>& x,
                           const std::vector<LogLine>& lines) {
  constexpr double kLeft = 80;
  constexpr double kTop = 20;
  constexpr double kWide = 380;
  constexpr double kHigh = 340;
  double low = 1e300;
  double high = 1e-300;
  for (const LogLine& line : lines) {
    const auto [least, most] = std::minmax_element(line.y.begin(), line.y.end());
    low = std::min(low, *least);
    high = std::max(high, *most);
  }
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::ceil(std::log10(high)));
  const auto across = [&](double value) {
    return kLeft + kWide * std::log(value / x.front()) / std::log(x.back() / x.front());
  };
  const auto down = [&](double value) {
    return kTop + kHigh * (last - std::log10(value)) / (last - first);
  };
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"720\" height=\"420\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"720\" height=\"420\" "
      "fill=\"white\"/>\n";
  char text[400];
  const auto add = [&](const char* format, auto... values) {
    std::snprintf(text, sizeof text, format, values...);
    svg += text;
  };
  for (int decade = first; decade <= last; ++decade) {
    const double y = down(std::pow(10.0, decade));
    add("<path d=\"M%.1f %.1fh%.1f\" stroke=\"#ddd\"/>\n", kLeft, y, kWide);
    if ((decade - first) % 2 == 0) {
      add("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">1e%d</text>\n", kLeft - 6, y + 4,
          decade);
    }
  }
  for (const double value : x) {
    add("<path d=\"M%.1f %.1fv%.1f\" stroke=\"#ddd\"/>\n", across(value), kTop, kHigh);
    add("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>\n", across(value),
        kTop + kHigh + 18, value);
  }
  add("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n", kLeft + kWide / 2,
      kTop + kHigh + 40, x_title.c_str());
  add("<text transform=\"translate(20 %.1f) rotate(-90)\" text-anchor=\"middle\">%s</text>\n",
      kTop + kHigh / 2, y_title.c_str());
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const LogLine& line = lines[k];
    std::string points;
    for (std::size_t i = 0; i < x.size(); ++i) {
      std::snprintf(text, sizeof text, "%.1f,%.1f ", across(x[i]), down(line.y[i]));
      points += text;
    }
    std::string style = "fill=\"none\" stroke=\"";
    style += line.colour;
    style +=
        line.dashed ? "\" stroke-width=\"2\" stroke-dasharray=\"6 4\"" : "\" stroke-width=\"2\"";
    const double y = kTop + 14 + 22 * static_cast<double>(k);
    svg += "<polyline points=\"";
    svg += points;
    svg += "\" ";
    svg += style;
    svg += "/>\n";
    add("<path d=\"M%.1f %.1fh30\" %s/>\n", kLeft + kWide + 16, y, style.c_str());
    add("<text x=\"%.1f\" y=\"%.1f\">%s</text>\n", kLeft + kWide + 54, y + 4, line.name.c_str());
  }
  std::ofstream out(file);
  out << svg << "</svg>\n";
  if (!out.flush()) {
    throw std::runtime_error("cannot write " + file);
  }
}

}  // namespace atelier
