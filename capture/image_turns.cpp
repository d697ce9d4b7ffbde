#include "capture/image_turns.h"

namespace atelier {

int quarters_shown(int exif_orientation) {
  const bool mirrored = exif_orientation == 2 || exif_orientation == 4 || exif_orientation == 5 ||
                        exif_orientation == 7;
  return mirrored ? -1 : quarters_upright(exif_orientation);
}

int quarters_upright(int exif_orientation) {
  switch (exif_orientation) {
    case 3:
    case 4:  // turned by half, then mirrored
      return 2;
    case 5:  // turned, then mirrored
    case 6:
      return 1;
    case 7:
    case 8:
      return 3;
    default:
      return 0;
  }
}

ByteImage turned_image(const ByteImage& image, int quarters) {
  const int turns = ((quarters % 4) + 4) % 4;
  if (turns == 0) {
    return image;
  }
  const bool side = turns % 2 != 0;
  ByteImage turned(side ? image.height : image.width, side ? image.width : image.height,
                   image.channels);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int to_x = turns == 1 ? image.height - 1 - y : turns == 2 ? image.width - 1 - x : y;
      const int to_y = turns == 1 ? x : turns == 2 ? image.height - 1 - y : image.width - 1 - x;
      for (int c = 0; c < image.channels; ++c) {
        turned.at(to_x, to_y, c) = image.at(x, y, c);
      }
    }
  }
  return turned;
}

Eigen::Vector2d turned_back(const Eigen::Vector2d& pixel, int quarters, int width, int height) {
  switch (quarters) {
    case 1:
      return {pixel.y(), height - pixel.x()};
    case 2:
      return {width - pixel.x(), height - pixel.y()};
    case 3:
      return {width - pixel.y(), pixel.x()};
    default:
      return pixel;
  }
}

}  // namespace atelier
