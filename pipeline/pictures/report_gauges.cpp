#include "pipeline/pictures/report_gauges.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

constexpr double kGaugeRow = 30;
constexpr double kGaugeWords = 235;  ///< left end of the words
constexpr double kGaugeLeft = 530;   ///< of the bars
constexpr double kGaugeWidth = 200;  ///< of a bar
constexpr double kGaugeRight = 280;  ///< for value and range
constexpr std::size_t kMaxWords = 50;

template <class... Values>
std::string svg_text(const char* format, Values... values) {
  char buffer[300];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

/// Ends of the bar.
struct Axis {
  double low = 0;
  double high = 1;

  /// Along the bar, in [0, 1].
  double place(double value) const { return std::clamp((value - low) / (high - low), 0.0, 1.0); }
};

/// From 0 to half as much again as may be; of what must be above a limit, from well below it to 1
/// for shares, and as far above it for others.
Axis axis_of(const Gauge& gauge) {
  const double limit = gauge.limit;
  if (!gauge.at_least) {
    return {0, limit > 0 ? 1.5 * limit : 1};
  }
  const bool share = limit < 1 && gauge.number <= 1;
  const double high = share ? 1 : 1.5 * std::max(limit, 1e-9);
  return {std::max(0.0, limit - 2 * (high - limit)), high};
}

std::string gauge_row(const Gauge& gauge, double y) {
  const Axis axis = axis_of(gauge);
  const double limit = kGaugeLeft + kGaugeWidth * axis.place(gauge.limit);
  const double mark = kGaugeLeft + kGaugeWidth * axis.place(gauge.number);
  const double from = gauge.at_least ? limit : kGaugeLeft;
  const double to = gauge.at_least ? kGaugeLeft + kGaugeWidth : std::max(limit, kGaugeLeft + 3);
  const char* color = gauge.met ? "#2f6b4f" : "#a40000";
  const std::string words = gauge.words.size() > kMaxWords
                                ? gauge.words.substr(0, gauge.words.rfind(' ', kMaxWords)) + " ..."
                                : gauge.words;
  return svg_text("<text x=\"0\" y=\"%.0f\" font-weight=\"600\">", y + 19) + html_text(gauge.name) +
         "</text>\n" +
         svg_text("<text x=\"%.0f\" y=\"%.0f\" font-size=\"12\" fill=\"#666\">", kGaugeWords,
                  y + 19) +
         html_text(words) + "<title>" + html_text(gauge.words) + "</title></text>\n" +
         svg_text(
             "<rect x=\"%.0f\" y=\"%.0f\" width=\"%.0f\" height=\"8\" rx=\"4\" "
             "fill=\"#eceef0\"/>\n",
             kGaugeLeft, y + 11, kGaugeWidth) +
         svg_text(
             "<rect x=\"%.1f\" y=\"%.0f\" width=\"%.1f\" height=\"8\" rx=\"4\" "
             "fill=\"#bfe0cd\"/>\n",
             from, y + 11, to - from) +
         svg_text("<circle cx=\"%.1f\" cy=\"%.0f\" r=\"6\" fill=\"%s\"/>\n", mark, y + 15, color) +
         svg_text("<text x=\"%.0f\" y=\"%.0f\" fill=\"%s\">", kGaugeLeft + kGaugeWidth + 16, y + 19,
                  color) +
         html_text(gauge.value) + "</text>\n" +
         svg_text("<text x=\"%.0f\" y=\"%.0f\" fill=\"#666\">", kGaugeLeft + kGaugeWidth + 116,
                  y + 19) +
         html_text(gauge.range) + (gauge.met ? "" : ", missed") + "</text>\n";
}

}  // namespace

std::string gauges_svg(std::span<const Gauge> gauges) {
  std::string rows;
  double height = 0;
  for (const Gauge& gauge : gauges) {
    if (std::isfinite(gauge.number) && std::isfinite(gauge.limit)) {
      rows += gauge_row(gauge, height);
      height += kGaugeRow;
    }
  }
  const double width = kGaugeLeft + kGaugeWidth + kGaugeRight;
  return rows.empty() ? ""
                      : svg_text(
                            "<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" "
                            "xmlns=\"http://www.w3.org/2000/svg\" font-size=\"13\" "
                            "font-family=\"system-ui, sans-serif\" fill=\"#222\">\n",
                            width, height, width) +
                            rows + "</svg>\n";
}

}  // namespace atelier
