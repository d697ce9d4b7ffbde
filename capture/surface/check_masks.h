#pragma once

#include <vector>

#include "core/camera.h"
#include "core/image.h"

namespace atelier {

enum class MaskFit {
  Good,      ///< or too little is seen by others to tell
  Inverted,  ///< says subject round most of the image's border
  Off,       ///< of another instant or person, or shifted
};

/// Whether each mask can be of the subject. First by itself: one that is set along 60% of the
/// image's border, and not nearly everywhere, is inverted, be it all of them. Then whether it can
/// be of the subject that the other masks show: of the cells of space that three quarters of at
/// least three other views take for subject, a mask must show half. The one that contradicts most
/// is told first and asked no more. One mask in four may be wrong. Our choice.
///
/// @param reach  m: half the side of the cube that is asked, round where the cameras look
/// Throws LogicError for masks of another size than their camera's. Cost: 110,000 cells x
/// views, and so many bytes.
std::vector<MaskFit> check_masks(const std::vector<Camera>& cameras,
                                 const std::vector<ByteImage>& masks, double reach = 2);

}  // namespace atelier
