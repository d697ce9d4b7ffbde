#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

#include "core/image.h"

namespace atelier {

/// Marks drawn over an image. Pixels, the first pixel's centre at (0.5, 0.5), parts outside the
/// image are cut off; colours linear RGB.

struct Polyline {
  std::vector<Eigen::Vector2d> points;
  bool closed = false;
  Eigen::Vector3f color{1, 1, 1};
  double width = 1.5;  ///< pixels, at least 1 is drawn
  double opacity = 1;  ///< [0,1]
};

struct Circle {
  Eigen::Vector2d center{0, 0};
  double radius = 3;  ///< pixels
  Eigen::Vector3f color{1, 1, 1};
  double width = 0;  ///< of the rim, pixels; 0: a filled disk
  double opacity = 1;
};

struct Text {
  enum class Anchor { Left, Center, Right };  ///< which part of the text is at `position`
  Eigen::Vector2d position{0, 0};             ///< on the text's base line
  std::string text;                           ///< ASCII; other characters become '?'
  double height = 14;                         ///< of a capital letter, pixels
  Eigen::Vector3f color{1, 1, 1};
  Anchor anchor = Anchor::Left;
  double halo = 0;  ///< width of a dark rim that keeps the text readable on anything, pixels
};

using Mark = std::variant<Polyline, Circle, Text>;

/// Width of a text in pixels at that height of its capitals.
double text_width(const std::string& text, double height);

/// The image (1, 3 or 4 channels; of colours the first, or all three; alpha is set where drawn)
/// with the marks over it, in their order, antialiased. Throws LogicError for another number of
/// channels or a mark with a number that is not finite.
Image drawn(Image picture, const std::vector<Mark>& marks);

}  // namespace atelier
