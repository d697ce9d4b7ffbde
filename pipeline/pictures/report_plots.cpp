#include "pipeline/pictures/report_plots.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

constexpr double kPlotWidth = 190;
constexpr double kHeight = 90;
constexpr double kCell = 250;
constexpr double kRow = 150;
constexpr double kLeft = 44;
constexpr double kTop = 24;
constexpr std::size_t kColumns = 4;

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[300];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string words(double x, double y, const char* anchor, const std::string& content) {
  return text("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) +
         html_text(content) + "</text>\n";
}

std::string one_plot(const FramePlot& plot, double x, double y) {
  const auto [low_at, high_at] = std::minmax_element(plot.values.begin(), plot.values.end());
  const bool has_target = std::isfinite(plot.target);
  const double low = std::min({0.0, *low_at, has_target ? plot.target : 0.0});
  const double most = has_target ? std::max(*high_at, plot.target) : *high_at;
  const double high = most > low ? most : low + 1;
  const double first = plot.frame_ids.front();
  const double frames = std::max(1.0, plot.frame_ids.back() - first);
  const auto height_of = [&](double value) {
    return y + kTop + kHeight * (1 - (value - low) / (high - low));
  };
  std::string line;
  std::string dots;
  for (std::size_t i = 0; i < plot.values.size(); ++i) {
    const double px = x + kLeft + kPlotWidth * (plot.frame_ids[i] - first) / frames;
    const double py = height_of(plot.values[i]);
    line += text("%.1f,%.1f ", px, py);
    dots += text("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\" fill=\"#2b5d8a\">", px, py) +
            text("<title>frame %d: %.4g</title></circle>\n", plot.frame_ids[i], plot.values[i]);
  }
  std::string target;
  if (has_target) {
    target = text("<path d=\"M%.1f %.1fh%.1f\" stroke=\"#b4690e\" stroke-dasharray=\"5 3\">",
                  x + kLeft, height_of(plot.target), kPlotWidth) +
             text("<title>target: %.4g</title></path>\n", plot.target);
  }
  const double bottom = y + kTop + kHeight;
  return words(x + kLeft, y + 14, "start", plot.label) +
         words(x + kLeft - 5, y + kTop + 6, "end", text("%.3g", high)) +
         words(x + kLeft - 5, bottom, "end", text("%.3g", low)) +
         words(x + kLeft, bottom + 15, "start", text("%d", plot.frame_ids.front())) +
         words(x + kLeft + kPlotWidth, bottom + 15, "end", text("%d", plot.frame_ids.back())) +
         text(
             "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"none\" "
             "stroke=\"#ccc\"/>\n",
             x + kLeft, y + kTop, kPlotWidth, kHeight) +
         target + "<polyline points=\"" + line +
         "\" fill=\"none\" stroke=\"#2b5d8a\" stroke-width=\"1.5\"/>\n" + dots;
}

}  // namespace

std::string plots_svg(const std::vector<FramePlot>& plots) {
  std::string content;
  std::size_t count = 0;
  for (const FramePlot& plot : plots) {
    if (plot.values.empty() || plot.values.size() != plot.frame_ids.size() ||
        !std::all_of(plot.values.begin(), plot.values.end(),
                     [](double value) { return std::isfinite(value); })) {
      continue;
    }
    content += one_plot(plot, kCell * static_cast<double>(count % kColumns),
                        kRow * static_cast<double>(count / kColumns));
    ++count;
  }
  if (count == 0) {
    return "";
  }
  const double width = kCell * static_cast<double>(std::min(count, kColumns));
  const double height = kRow * static_cast<double>((count + kColumns - 1) / kColumns);
  return text(
             "<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" xmlns=\"http://www.w3.org/2000/svg\" "
             "font-size=\"11\" font-family=\"system-ui, sans-serif\" fill=\"#333\">\n",
             width, height, width) +
         content + "</svg>\n";
}

double scaled_limit(std::span<const KeyFigure> figures, std::string_view metric, double scale) {
  const auto found = std::find_if(figures.begin(), figures.end(),
                                  [&](const KeyFigure& one) { return one.metric == metric; });
  return found == figures.end() ? std::numeric_limits<double>::quiet_NaN() : scale * found->limit;
}

FramePlot thinned(const FramePlot& all, std::size_t about) {
  FramePlot some{all.label, {}, {}, all.target};
  const std::size_t stride = 1 + all.values.size() / about;
  for (std::size_t i = 0; i < all.values.size(); i += stride) {
    some.frame_ids.push_back(all.frame_ids[i]);
    some.values.push_back(all.values[i]);
  }
  return some;
}

}  // namespace atelier
