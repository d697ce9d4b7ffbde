#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// Outlines of panels, each made its own mirror image, or that of another, where it nearly is: what
/// a capture or a drape adds to a left half is no more right than what it adds to a right one.
///
/// Each outline that matches the mirrored one of itself or of another, which matches it best in
/// turn, to `most` metres in the mean square, and to a twentieth of the side of a square of its
/// area, becomes the mean of the two: corner by corner with the points between at the same shares
/// of the way, where both have as many corners within four times `most` of each other, else of
/// nearest points. The six others most alike are compared (alike_outlines.h). Points are as many as
/// before. Our choice.
///
/// @param outlines  [N,2] m each, closed, counter-clockwise; may be turned by any angle
std::vector<Points2> symmetric_outlines(const std::vector<Points2>& outlines, double most);

}  // namespace atelier
