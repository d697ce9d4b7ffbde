#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/image.h"

namespace atelier {

/// An image and what is written under it.
struct CaptionedImage {
  Image image;          ///< 1 or 3 channels
  std::string caption;  ///< "" for none; its lines are cut with "..." where they do not fit
};

struct ContactSheetOptions {
  int columns = 0;                             ///< 0: as square as it gets
  int cell_width = 0;                          ///< pixels; images are scaled to it; 0: as they are
  bool even_rows = true;                       ///< false: each as tall as what is in it
  int gap = 12;                                ///< pixels between cells and around them, [0, 1000]
  double text_height = 11;                     ///< of a capital letter, pixels, (0, 200]
  std::string title = {};                      ///< above the grid, "" for none
  Eigen::Vector3f paper{0.93f, 0.93f, 0.93f};  ///< linear RGB
  Eigen::Vector3f ink{0.02f, 0.02f, 0.02f};
};

/// The images in a grid, row by row, each centred in a cell of the largest one's size, or of its
/// row's largest height. Linear RGB. Throws LogicError if there is none, or for images of other
/// channels or without pixels, or options out of range.
Image contact_sheet(const std::vector<CaptionedImage>& pictures,
                    const ContactSheetOptions& options = {});

/// Area-averaged where smaller, bilinear where larger. Throws LogicError for an empty image or
/// size.
Image resized(const Image& image, int width, int height);

}  // namespace atelier
