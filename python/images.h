#pragma once

#include "core/image.h"
#include "python/arrays.h"

namespace atelier::python {

/// An image as an array [H,W] (of one channel) or [H,W,C] that has taken over its memory.
template <class T>
py::array image_array(ImageOf<T> image) {
  const py::ssize_t height = image.height;
  const py::ssize_t width = image.width;
  const py::ssize_t channels = image.channels;
  const py::capsule owner = owner_of(std::move(image.data));
  const T* data = owner.get_pointer<std::vector<T>>()->data();
  if (channels == 1) {
    return py::array(py::dtype::of<T>(), {height, width}, {}, data, owner);
  }
  return py::array(py::dtype::of<T>(), {height, width, channels}, {}, data, owner);
}

/// An image of an array [H,W] or [H,W,C], copied: float32 is linear light, uint8 sRGB bytes.
/// Throws DataError for another type or shape, or a number that is not finite.
template <class T>
ImageOf<T> image_of(py::handle given) {
  const std::string expected = std::string("[H,W] or [H,W,C] ") +
                               (sizeof(T) == 1 ? "uint8 (sRGB bytes)" : "numbers (linear light)");
  const py::array array = number_array(given, sizeof(T) == 1, expected);
  if ((array.ndim() != 2 && array.ndim() != 3) || array.size() == 0 ||
      (sizeof(T) == 1 && array.itemsize() != 1)) {
    throw DataError("", "", array_text(array), expected);
  }
  constexpr py::ssize_t kLongest = 65'536;
  if (array.shape(0) > kLongest || array.shape(1) > kLongest ||
      (array.ndim() == 3 && array.shape(2) > 4)) {
    throw DataError("", "", array_text(array), "65536 pixels a side, 4 channels at most");
  }
  ImageOf<T> image(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
                   array.ndim() == 3 ? static_cast<int>(array.shape(2)) : 1);
  copy_numbers(array, image.data.data(), static_cast<Eigen::Index>(image.data.size()));
  if constexpr (std::is_floating_point_v<T>) {
    require_finite(image.data.data(), static_cast<Eigen::Index>(image.data.size()),
                   static_cast<Eigen::Index>(image.width) * image.channels);
  }
  return image;
}

}  // namespace atelier::python
