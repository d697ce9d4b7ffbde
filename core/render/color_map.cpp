#include "core/render/color_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/render/drawing.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

using Table = std::array<Eigen::Vector3f, 256>;

Table opencv_table(int map) {
  cv::Mat grey(1, 256, CV_8UC1);
  for (int i = 0; i < 256; ++i) {
    grey.at<unsigned char>(0, i) = static_cast<unsigned char>(i);
  }
  cv::Mat colored;
  cv::applyColorMap(grey, colored, map);
  ByteImage bytes(256, 1, 3);
  for (int i = 0; i < 256; ++i) {
    const auto bgr = colored.at<cv::Vec3b>(0, i);
    for (int c = 0; c < 3; ++c) {
      bytes.at(i, 0, c) = bgr[2 - c];
    }
  }
  const Image linear = linear_from_srgb(bytes);
  Table table;
  for (int i = 0; i < 256; ++i) {
    table[static_cast<std::size_t>(i)] = {linear.at(i, 0, 0), linear.at(i, 0, 1),
                                          linear.at(i, 0, 2)};
  }
  return table;
}

Eigen::Vector3f from_table(const Table& table, double t) {
  const double x = t * 255;
  const auto i = std::min<std::size_t>(saturating_cast<std::size_t>(x), 254);
  const auto f = static_cast<float>(x - static_cast<double>(i));
  return (1 - f) * table[i] + f * table[i + 1];
}

std::string tick_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

Eigen::Vector3f map_color(ColorMap map, double t) {
  if (std::isnan(t)) {
    return {0.3f, 0.3f, 0.3f};
  }
  t = std::clamp(t, 0.0, 1.0);
  switch (map) {
    case ColorMap::Turbo: {
      static const Table table = opencv_table(cv::COLORMAP_TURBO);
      return from_table(table, t);
    }
    case ColorMap::Diverging: {
      const Eigen::Vector3f blue(0.04f, 0.13f, 0.58f);
      const Eigen::Vector3f white(0.86f, 0.86f, 0.86f);
      const Eigen::Vector3f red(0.55f, 0.03f, 0.04f);
      const auto s = static_cast<float>(2 * t - 1);
      return white + std::abs(s) * ((s < 0 ? blue : red) - white);
    }
    case ColorMap::Viridis:
      break;
  }
  static const Table table = opencv_table(cv::COLORMAP_VIRIDIS);
  return from_table(table, t);
}

Colors map_colors(ColorMap map, const Eigen::VectorXd& values, double low, double high) {
  ATELIER_CHECK(low < high, "a colour map needs low < high");
  Colors colors(values.size(), 3);
  for (Index i = 0; i < values.size(); ++i) {
    colors.row(i) = map_color(map, (values[i] - low) / (high - low));
  }
  return colors;
}

Image color_bar(ColorMap map, double low, double high, const std::string& label, int height) {
  ATELIER_CHECK(low < high, "a colour bar needs low < high");
  ATELIER_CHECK(height >= 60, "a colour bar needs a height of at least 60 pixels");
  constexpr int kBar = 22;
  constexpr int kEdge = 12;
  constexpr double kText = 11;
  const std::array<double, 3> ticks{high, 0.5 * (low + high), low};
  double text = text_width(label, kText) - kBar - 8;
  for (const double tick : ticks) {
    text = std::max(text, text_width(tick_text(tick), kText));
  }
  const int top = label.empty() ? kEdge : kEdge + 26;
  const int bottom = height - kEdge;
  Image image(2 * kEdge + kBar + 8 + saturating_cast<int>(std::ceil(text)), height, 3, 1.0f);
  for (int y = top; y < bottom; ++y) {
    const double t = 1 - (y - top) / std::max(1.0, bottom - top - 1.0);
    const Eigen::Vector3f color = map_color(map, t);
    for (int x = kEdge; x < kEdge + kBar; ++x) {
      for (int c = 0; c < 3; ++c) {
        image.at(x, y, c) = color[c];
      }
    }
  }
  const Eigen::Vector3f ink(0.02f, 0.02f, 0.02f);
  std::vector<Mark> marks;
  marks.push_back(Text{{kEdge, kEdge + kText}, label, kText, ink, Text::Anchor::Left, 0});
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double y = top + (bottom - top - 1) * 0.5 * static_cast<double>(i);
    const double base = std::clamp(y + 0.5 * kText, top + kText, bottom + 0.0);
    marks.push_back(
        Text{{kEdge + kBar + 8.0, base}, tick_text(ticks[i]), kText, ink, Text::Anchor::Left, 0});
  }
  return drawn(std::move(image), marks);
}

}  // namespace atelier
