#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "capture/keypoints2d.h"
#include "core/image.h"
#include "core/io/image_file.h"

namespace atelier {

/// An image as its file holds it.
struct EncodedImage {
  std::vector<std::byte> bytes;
  std::string extension;  ///< ".png", ".jpg", ...: what the bytes are, whatever the file is called
};

/// Opens the frames of a data set one at a time; keeps the zip or video open that it read last.
/// Reading frame after frame is what it is made for: in a video, a frame before the last one
/// starts again from the beginning, and an HDF5 file is read for all cameras of a frame at once.
///
/// Every function gives nothing where the data set has nothing, and throws DataError, with the
/// file, where what it has is damaged: the caller decides whether the frame can be left out. One
/// reader is for one thread; readers of the same data set do not disturb each other.
class FrameReader {
 public:
  explicit FrameReader(Dataset dataset, const Limits& limits = {});
  ~FrameReader();
  FrameReader(FrameReader&&) noexcept;
  FrameReader& operator=(FrameReader&&) noexcept;

  const Dataset& dataset() const;

  /// Header of the image's file; of a video, width, height and 3 channels.
  std::optional<ImageHeader> image_header(Index camera_idx, int frame_id);
  /// The image as sRGB bytes, 1 or 3 channels, distorted as taken, gain not removed.
  std::optional<ByteImage> byte_image(Index camera_idx, int frame_id);
  /// The same in linear light.
  std::optional<Image> image(Index camera_idx, int frame_id);
  /// 255 on the person, 0 elsewhere: from the mask, or from the labels where there is no mask.
  /// Masks of 0 and 1, of palettes, with alpha and soft ones (at one half) become that; one that is
  /// an exact scale of the camera's images (to a pixel) has their size.
  std::optional<ByteImage> mask(Index camera_idx, int frame_id);
  /// Labels of the taxonomy "atelier" (label_taxonomy.h); their size as of masks.
  std::optional<ByteImage> labels(Index camera_idx, int frame_id);
  /// Header of the file that `mask` reads.
  std::optional<ImageHeader> mask_header(Index camera_idx, int frame_id);
  /// Everybody who was found; empty if nobody was or nothing is there.
  std::vector<PersonKeypoints> keypoints(Index camera_idx, int frame_id);
  /// Everybody in space, metres, Y up.
  std::vector<PersonPoints> keypoints3d(int frame_id);

  /// The image's own bytes, checked by its header; of a video, a PNG of the frame.
  std::optional<EncodedImage> encoded_image(Index camera_idx, int frame_id);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
