#pragma once

#include "core/camera.h"
#include "core/image.h"

namespace atelier {

/// The camera without its distortion: the same place, size and focal lengths.
Camera without_distortion(const Camera& camera);

/// The image of that camera: each pixel is read where the distorted camera has it, between four
/// pixels; 0 outside. Any number of channels. Throws LogicError if the image is not of the camera's
/// size.
Image undistorted(const Camera& camera, const Image& image);

/// The same of a mask or labels: the nearest pixel; 0 outside.
ByteImage undistorted(const Camera& camera, const ByteImage& image);

}  // namespace atelier
