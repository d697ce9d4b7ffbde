#include "pipeline/pictures/report_gauges.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/printable.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

constexpr double kBarWidth = 200;
constexpr double kBarHeight = 16;
constexpr double kBarEnd = 7;  ///< room beside the bar for a mark at its end

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

/// Of 1, not of decibels.
bool is_large_share(const Gauge& gauge) {
  return gauge.at_least && gauge.limit < 1 && gauge.number <= 1;
}

/// From 0 to half as much again as may be; of what must be above a limit, from well below it to 1
/// for shares, and as far above it for others.
Axis axis_of(const Gauge& gauge) {
  const double limit = gauge.limit;
  if (!gauge.at_least) {
    return {0, limit > 0 ? 1.5 * limit : 1};
  }
  const double high = is_large_share(gauge) ? 1 : 1.5 * std::max(limit, 1e-9);
  return {std::max(0.0, limit - 2 * (high - limit)), high};
}

std::string bar_svg(const Gauge& gauge, const char* color) {
  const Axis axis = axis_of(gauge);
  const double limit = kBarEnd + kBarWidth * axis.place(gauge.limit);
  const double mark = kBarEnd + kBarWidth * axis.place(gauge.number);
  const double from = gauge.at_least ? limit : kBarEnd;
  const double to = gauge.at_least ? kBarEnd + kBarWidth : std::max(limit, kBarEnd + 3);
  const double width = kBarWidth + 2 * kBarEnd;
  const auto bar = [](double x, double length, const char* fill) {
    return svg_text("<rect x=\"%.1f\" y=\"4\" width=\"%.1f\" height=\"8\" rx=\"4\" fill=\"%s\"/>",
                    x, length, fill);
  };
  return svg_text(
             "<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" "
             "xmlns=\"http://www.w3.org/2000/svg\">",
             width, kBarHeight, width, kBarHeight) +
         bar(kBarEnd, kBarWidth, "#eceef0") + bar(from, to - from, "#bfe0cd") +
         svg_text("<rect x=\"%.1f\" y=\"1\" width=\"2\" height=\"14\" fill=\"#555\"/>", limit - 1) +
         svg_text("<circle cx=\"%.1f\" cy=\"8\" r=\"6\" fill=\"%s\"/></svg>", mark, color);
}

std::string gauge_row(const Gauge& gauge) {
  const char* color = gauge.met ? "#2f6b4f" : "#a40000";
  const std::string key = "<code>" + html_text(gauge.name) + "</code>";
  const std::string what =
      gauge.words.empty() ? key
                          : html_text(gauge.words) + " <span class=\"quiet\">" + key + "</span>";
  return "<tr><td>" + what + "</td><td>" + bar_svg(gauge, color) +
         "</td><td style=\"color:" + color + "\">" + html_text(gauge.value) +
         "</td><td class=\"quiet\">" + html_text(gauge.range) + (gauge.met ? "" : ", missed") +
         "</td></tr>\n";
}

std::string gauges_table(const std::string& rows) {
  return rows.empty() ? "" : "<table class=\"gauges\">\n" + rows + "</table>\n";
}

}  // namespace

double share_of_allowed(const Gauge& gauge) {
  if (gauge.at_least && !is_large_share(gauge)) {
    return std::pow(10, (gauge.limit - gauge.number) / 20);
  }
  const double error = gauge.at_least ? 1 - gauge.number : gauge.number;
  const double allowed = gauge.at_least ? 1 - gauge.limit : gauge.limit;
  return allowed > 0 ? error / allowed : error > 0 ? std::numeric_limits<double>::infinity() : 1;
}

std::string gauges_html(std::span<const Gauge> gauges) {
  std::string first;
  std::string others;
  std::int64_t folded = 0;
  for (const Gauge& gauge : gauges) {
    if (std::isfinite(gauge.number) && std::isfinite(gauge.limit)) {
      (gauge.first ? first : others) += gauge_row(gauge);
      folded += gauge.first ? 0 : 1;
    }
  }
  return gauges_table(first) + (folded == 0
                                    ? ""
                                    : "<details><summary>" + counted(folded, "more figure") +
                                          "</summary>\n" + gauges_table(others) + "</details>\n");
}

}  // namespace atelier
