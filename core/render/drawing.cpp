#include "core/render/drawing.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kCapitals = 22;   // pixels of a capital letter at font scale 1
constexpr double kReach = 30'000;  // far beyond any image, within OpenCV's 16-bit coordinates

using Mask = ImageOf<float>;  // coverage in [0,1], of the picture's size

// Pixels whose centres lie within [low, high], clipped to n of them.
struct Span {
  int begin, end;
};
Span pixels_within(double low, double high, int n) {
  return {
      saturating_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, static_cast<double>(n))),
      saturating_cast<int>(std::clamp(std::floor(high - 0.5) + 1, 0.0, static_cast<double>(n)))};
}

// Coverage of the shape `distance(point) <= 0` (a signed distance) within a box: a ramp one pixel
// wide across its border.
template <class Distance>
void cover(Mask& mask, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
           const Distance& distance) {
  const Span xs = pixels_within(low.x() - 1, high.x() + 1, mask.width);
  const Span ys = pixels_within(low.y() - 1, high.y() + 1, mask.height);
  for (int y = ys.begin; y < ys.end; ++y) {
    for (int x = xs.begin; x < xs.end; ++x) {
      const double d = distance(Eigen::Vector2d(x + 0.5, y + 0.5));
      float& value = mask.at(x, y);
      value = std::max(value, static_cast<float>(std::clamp(0.5 - d, 0.0, 1.0)));
    }
  }
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

void blend(Image& picture, const Mask& mask, const Eigen::Vector3f& color, double opacity) {
  const int colors = std::min(picture.channels, 3);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const float a = static_cast<float>(opacity) * mask.at(x, y);
      if (a <= 0) {
        continue;
      }
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

void draw(Image& picture, const Polyline& line) {
  ATELIER_CHECK(line.color.allFinite() && std::isfinite(line.width) && std::isfinite(line.opacity),
                "a polyline needs finite numbers");
  for (const Eigen::Vector2d& p : line.points) {
    ATELIER_CHECK(p.allFinite(), "a polyline needs finite points");
  }
  Mask mask(picture.width, picture.height, 1);
  const double half = 0.5 * std::max(1.0, line.width);
  const std::size_t count = line.points.size();
  const std::size_t segments = line.closed ? count : std::max<std::size_t>(count, 2) - 1;
  for (std::size_t i = 0; i < segments && count > 0; ++i) {
    const Eigen::Vector2d a = line.points[i];
    const Eigen::Vector2d b = line.points[(i + 1) % count];
    const Eigen::Vector2d ab = b - a;
    const double length2 = ab.squaredNorm();
    const Eigen::Vector2d reach(half, half);
    cover(mask, a.cwiseMin(b) - reach, a.cwiseMax(b) + reach, [&](const Eigen::Vector2d& p) {
      const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
      return (p - a - t * ab).norm() - half;
    });
  }
  blend(picture, mask, line.color, std::clamp(line.opacity, 0.0, 1.0));
}

void draw(Image& picture, const Circle& circle) {
  ATELIER_CHECK(circle.center.allFinite() && circle.color.allFinite() &&
                    std::isfinite(circle.radius) && circle.radius >= 0 &&
                    std::isfinite(circle.width) && std::isfinite(circle.opacity),
                "a circle needs finite numbers and a radius that is not negative");
  Mask mask(picture.width, picture.height, 1);
  const double half = 0.5 * std::max(0.0, circle.width);
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(circle.radius + half);
  cover(mask, circle.center - reach, circle.center + reach, [&](const Eigen::Vector2d& p) {
    const double d = (p - circle.center).norm() - circle.radius;
    return half > 0 ? std::abs(d) - half : d;
  });
  blend(picture, mask, circle.color, std::clamp(circle.opacity, 0.0, 1.0));
}

Mask text_mask(const Image& picture, const std::string& text, cv::Point origin, double scale,
               int thickness) {
  cv::Mat bytes = cv::Mat::zeros(picture.height, picture.width, CV_8UC1);
  cv::putText(bytes, text, origin, kFont, scale, cv::Scalar(255), thickness, cv::LINE_AA);
  Mask mask(picture.width, picture.height, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      mask.at(x, y) = static_cast<float>(bytes.at<unsigned char>(y, x)) / 255.0f;
    }
  }
  return mask;
}

int pen(double width) {
  return std::max(1, saturating_cast<int>(std::round(width)));
}

void draw(Image& picture, const Text& label) {
  ATELIER_CHECK(label.position.allFinite() && label.color.allFinite() &&
                    std::isfinite(label.height) && label.height > 0 && std::isfinite(label.halo),
                "a label needs finite numbers and a positive height");
  const std::string text = ascii(label.text);
  const double scale = std::min(label.height, 1000.0) / kCapitals;
  const int thickness = pen(scale);
  double x = label.position.x();
  if (label.anchor != Text::Anchor::Left) {
    x -= text_width(text, label.height) * (label.anchor == Text::Anchor::Center ? 0.5 : 1);
  }
  // Our pixel centres lie at halves, OpenCV's at whole numbers.
  const auto whole = [](double value) {
    return saturating_cast<int>(std::round(std::clamp(value - 0.5, -kReach, kReach)));
  };
  const cv::Point origin(whole(x), whole(label.position.y()));
  if (label.halo > 0) {
    const int wide = thickness + 2 * pen(std::min(label.halo, 100.0));
    blend(picture, text_mask(picture, text, origin, scale, wide), Eigen::Vector3f::Zero(), 0.75);
  }
  blend(picture, text_mask(picture, text, origin, scale, thickness), label.color, 1);
}

}  // namespace

double text_width(const std::string& text, double height) {
  int base = 0;
  const double scale = std::min(height, 1000.0) / kCapitals;
  return cv::getTextSize(ascii(text), kFont, scale, pen(scale), &base).width;
}

Image drawn(Image picture, const std::vector<Mark>& marks) {
  ATELIER_CHECK(picture.channels == 1 || picture.channels == 3 || picture.channels == 4,
                "drawing needs an image of 1, 3 or 4 channels");
  if (picture.width == 0 || picture.height == 0) {
    return picture;
  }
  for (const Mark& mark : marks) {
    std::visit([&](const auto& m) { draw(picture, m); }, mark);
  }
  return picture;
}

}  // namespace atelier
