#pragma once

#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/options.h"

namespace atelier {

/// A camera's background without the person: mean and spread of each pixel.
struct EmptyStage {
  Image mean;    ///< [H,W,3] linear RGB
  Image spread;  ///< [H,W,1] standard deviation of the difference in shade (see
                 ///< MaskOptions::threshold)
};

/// From clean plates: images of the empty stage, of one camera. One alone does; the spread is then
/// that of the whole image's noise. Throws DataError for none, or plates of two sizes.
EmptyStage background_of_plates(const std::vector<Image>& plates);

struct MaskOptions {
  double threshold = 6;          ///< deviations from the background that make foreground, [1, 100]
  double min_difference = 0.03;  ///< of gamma-coded values, that is foreground at least, [0, 1]
  double shadow_darkest = 0.4;  ///< a pixel with the background's colour and at least this share of
                                ///< its light is a shadow, (0, 1]; 1: shadows count as foreground
  double shadow_hue = 0.03;     ///< how far a shadow's chromaticity may be off, [0, 1]
  double opening = 1;        ///< px of an image 1000 rows high: thinner than twice this goes, and
                             ///< single pixels unless it is 0, [0, 50]
  double closing = 3;        ///< px of the same: gaps narrower than twice this are filled, [0, 50]
  double min_part = 0.05;    ///< parts smaller than this share of the largest go, and those
                             ///< smaller than holes that are filled, [0, 1]
  double max_hole = 0.0005;  ///< holes smaller than this share of the image are filled, [0, 1]
};
OptionTable describe(MaskOptions& options);

/// 255 where the image is not the background, 0 elsewhere; shadows are told by their colour
/// (Horprasert 1999: same chromaticity, less light). Cleaned by `clean_mask`. Throws LogicError
/// for sizes that differ.
ByteImage mask_from_background(const Image& image, const EmptyStage& background,
                               const MaskOptions& options = {});

/// Background that the frames themselves show.
struct MovingBackground {
  EmptyStage background;
  ByteImage covered;       ///< 255 where less than a third of the frames agree: no background came
                           ///< back, and what is taken for it may be a person
  double still_share = 0;  ///< share of pixels whose values over time fall apart
  ByteImage seen_open;     ///< 255 where it was seen in some frames outside of any mask's holes
};

/// From the frames themselves: the most frequent value of each pixel, up to the noise of the
/// images. The background comes back to one value, a person's clothes shade as they move: it may be
/// covered for more than half of the frames, unless by somebody who stands still. `still_share`
/// says for how much of the image it is in doubt (pixels that take two values). Throws DataError
/// for fewer than five frames, or frames of two sizes.
MovingBackground background_over_time(const std::vector<Image>& frames,
                                      const MaskOptions& options = {});

/// mask_from_background, where the background is known; a pixel that was `covered` and looks as
/// usual goes with most of its surroundings (our choice: the print of a dress that stays in one
/// place takes the same shade by chance). Then the holes are filled that the mask encloses, unless
/// background is seen in them: for most of a hole, in the open in other frames, or of a colour that
/// the open background has nearby (our choice). What stands still in one place for all frames is
/// taken for background where it has no edge.
ByteImage mask_over_time(const Image& image, const MovingBackground& moving,
                         const MaskOptions& options = {});

/// Share of a mask's outline on both sides of which the image looks alike, by what makes
/// foreground: a few hundredths of a right mask; more of one that cuts through somebody who stood
/// still, or that takes background in. 0 of a mask without an outline. Throws LogicError for sizes
/// that differ.
double outline_without_edge(const Image& image, const ByteImage& mask, const EmptyStage& background,
                            const MaskOptions& options = {});

struct ChromaOptions {
  std::vector<double> key = {0, 0.6,
                             0.1};  ///< linear RGB of the screen; [0,0,0]: told from the borders
  double tolerance = 0.12;          ///< how far its chromaticity may be off, (0, 1]
  double darkest = 0.02;  ///< linear luminance below which a pixel has no hue and counts as screen
                          ///< if its surroundings do, [0, 1]
};
OptionTable describe(ChromaOptions& options);

/// 255 where the image does not have the screen's hue, whatever its brightness (shadows on the
/// screen are screen). Cleaned by `clean_mask`. Throws DataError where the key is grey: white and
/// grey screens need plates.
ByteImage mask_by_chroma(const Image& image, const ChromaOptions& chroma,
                         const MaskOptions& options = {});

/// Opening, closing, the large parts, small holes filled: in that order.
ByteImage clean_mask(const ByteImage& mask, const MaskOptions& options = {});

/// Area of the intersection over that of the union of what is not 0; 1 where both are empty.
double mask_iou(const ByteImage& a, const ByteImage& b);

}  // namespace atelier
