#pragma once

#include <Eigen/Core>

#include "core/image.h"

namespace atelier {

/// The square of an image that a network of one person is given, turned so that the person stands
/// upright in it.
struct PersonCrop {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< px of the image
  double side = 0;                                   ///< px, above 0
  double turn = 0;  ///< rad; "up" of the crop is (sin, -cos) of it in the image
};

/// The crop whose center is between a person's hips and whose side is 2.5 times the distance to a
/// point on the circle round the whole person, towards the head: what the person detector and the
/// landmarks give (Bazarevsky et al. 2020, "BlazePose", 3.1; the factor of 1.25 about the circle as
/// in MediaPipe's published graph).
PersonCrop person_crop(const Eigen::Vector2d& hips, const Eigen::Vector2d& above);

/// The whole image in the middle of a square.
PersonCrop image_crop(int width, int height);

/// A point of the crop, each coordinate in [0, 1] from its upper left corner, in the image, px; and
/// back.
Eigen::Vector2d from_crop(const PersonCrop& crop, const Eigen::Vector2d& point);
Eigen::Vector2d into_crop(const PersonCrop& crop, const Eigen::Vector2d& pixel);

/// Share of the two squares' common area in their union, [0, 1], as if they were not turned.
double overlap(const PersonCrop& a, const PersonCrop& b);

/// The crop as `size` x `size` pixels of three channels, `low` for 0 and `high` for 255; black
/// beyond the image. Bilinear at each pixel's centre without a filter, as the networks were made
/// for. Throws LogicError for an image of other than 1 or 3 channels and a crop without area.
Image sampled_crop(const ByteImage& image, const PersonCrop& crop, int size, float low, float high);

}  // namespace atelier
