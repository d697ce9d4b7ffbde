#pragma once

#include <Eigen/Core>
#include <span>

#include "core/camera.h"
#include "core/image.h"

namespace atelier {

/// Share of the pixels of masks, [0,1], that the other cameras' masks agree with: on the ray of
/// such a pixel is a place that nine tenths of the cameras that have it in their image, two at
/// least (one of two cameras), have on their mask. Of masks of one thing and right poses that is
/// nearly 1, or the visual hull misses parts of its silhouettes; 0 of cameras that see nothing in
/// common. Some pixels of each mask are asked, at 96 places on their rays from 0.3 to 2 times the
/// distance to `middle`. O(cameras^2).
/// @param masks  one for each camera, of its size; empty ones are cameras without one
/// @param middle  m, near the thing: where cameras look
double silhouette_agreement(std::span<const Camera> cameras, std::span<const ByteImage> masks,
                            const Eigen::Vector3d& middle);

}  // namespace atelier
