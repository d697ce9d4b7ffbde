#include "core/render/drawing.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"

namespace atelier {

namespace {

constexpr int kShift = 4;  // sixteenths of a pixel in OpenCV's fixed-point coordinates
constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kCapitals = 22;   // pixels of a capital letter at font scale 1
constexpr double kReach = 30'000;  // far beyond any picture, within OpenCV's 16-bit coordinates

// Our pixel centres lie at halves, OpenCV's at whole numbers.
cv::Point fixed_point(const Eigen::Vector2d& p) {
  const auto one = [](double value) {
    return static_cast<int>(std::lround(std::clamp(value - 0.5, -kReach, kReach) * (1 << kShift)));
  };
  return {one(p.x()), one(p.y())};
}

std::string ascii(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0u) == 0x80u) {
      continue;  // the rest of a UTF-8 character whose first byte became '?'
    }
    result += byte >= 32 && byte < 127 ? c : '?';
  }
  return result;
}

void blend(Image& picture, const cv::Mat& mask, const Eigen::Vector3f& color, double opacity) {
  const int colors = std::min(picture.channels, 3);
  for (int y = 0; y < mask.rows; ++y) {
    const auto* row = mask.ptr<unsigned char>(y);
    for (int x = 0; x < mask.cols; ++x) {
      if (row[x] == 0) {
        continue;
      }
      const float a = static_cast<float>(opacity) * static_cast<float>(row[x]) / 255.0f;
      for (int c = 0; c < colors; ++c) {
        float& value = picture.at(x, y, c);
        value += a * (color[c] - value);
      }
      if (picture.channels == 4) {
        float& alpha = picture.at(x, y, 3);
        alpha += a * (1 - alpha);
      }
    }
  }
}

int pen(double width) {
  return std::max(1, static_cast<int>(std::lround(width)));
}

void draw(Image& picture, cv::Mat& mask, const Polyline& line) {
  ATELIER_CHECK(line.color.allFinite() && std::isfinite(line.width) && std::isfinite(line.opacity),
                "a polyline needs finite numbers");
  std::vector<cv::Point> points;
  for (const Eigen::Vector2d& p : line.points) {
    ATELIER_CHECK(p.allFinite(), "a polyline needs finite points");
    points.push_back(fixed_point(p));
  }
  if (points.empty()) {
    return;
  }
  cv::polylines(mask, points, line.closed, cv::Scalar(255), pen(line.width), cv::LINE_AA, kShift);
  blend(picture, mask, line.color, std::clamp(line.opacity, 0.0, 1.0));
}

void draw(Image& picture, cv::Mat& mask, const Circle& circle) {
  ATELIER_CHECK(circle.center.allFinite() && circle.color.allFinite() &&
                    std::isfinite(circle.radius) && circle.radius >= 0 &&
                    std::isfinite(circle.width) && std::isfinite(circle.opacity),
                "a circle needs finite numbers and a radius that is not negative");
  const int radius = static_cast<int>(std::lround(std::min(circle.radius, kReach) * (1 << kShift)));
  cv::circle(mask, fixed_point(circle.center), radius, cv::Scalar(255),
             circle.width > 0 ? pen(circle.width) : cv::FILLED, cv::LINE_AA, kShift);
  blend(picture, mask, circle.color, std::clamp(circle.opacity, 0.0, 1.0));
}

void draw(Image& picture, cv::Mat& mask, const Label& label) {
  ATELIER_CHECK(label.position.allFinite() && label.color.allFinite() &&
                    std::isfinite(label.height) && label.height > 0 && std::isfinite(label.halo),
                "a label needs finite numbers and a positive height");
  const std::string text = ascii(label.text);
  const double scale = std::min(label.height, 1000.0) / kCapitals;
  const int thickness = pen(scale);
  double x = label.position.x();
  if (label.anchor != Label::Anchor::Left) {
    x -= text_width(text, label.height) * (label.anchor == Label::Anchor::Center ? 0.5 : 1);
  }
  const cv::Point origin(
      static_cast<int>(std::lround(std::clamp(x - 0.5, -kReach, kReach))),
      static_cast<int>(std::lround(std::clamp(label.position.y() - 0.5, -kReach, kReach))));
  if (label.halo > 0) {
    cv::putText(mask, text, origin, kFont, scale, cv::Scalar(255), thickness + 2 * pen(label.halo),
                cv::LINE_AA);
    blend(picture, mask, Eigen::Vector3f::Zero(), 0.75);
    mask.setTo(0);
  }
  cv::putText(mask, text, origin, kFont, scale, cv::Scalar(255), thickness, cv::LINE_AA);
  blend(picture, mask, label.color, 1);
}

}  // namespace

double text_width(const std::string& text, double height) {
  int base = 0;
  const double scale = std::min(height, 1000.0) / kCapitals;
  return cv::getTextSize(ascii(text), kFont, scale, pen(scale), &base).width;
}

Image drawn(Image picture, const std::vector<Mark>& marks) {
  ATELIER_CHECK(picture.channels == 1 || picture.channels == 3 || picture.channels == 4,
                "drawing needs a picture of 1, 3 or 4 channels");
  if (picture.width == 0 || picture.height == 0) {
    return picture;
  }
  cv::Mat mask = cv::Mat::zeros(picture.height, picture.width, CV_8UC1);
  for (const Mark& mark : marks) {
    std::visit([&](const auto& m) { draw(picture, mask, m); }, mark);
    mask.setTo(0);
  }
  return picture;
}

}  // namespace atelier
