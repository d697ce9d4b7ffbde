#pragma once

#include <cstddef>
#include <vector>

#include "core/camera.h"

namespace atelier {

/// The views of one of several shares of an instant's stereo, increasing: those that stand side by
/// side around the cameras' middle (by azimuth, Y up), since each is compared with its neighbours,
/// whose maps are then computed too. Shares are disjoint, together all views, and equal to one
/// view. Throws LogicError unless 0 <= share < shares.
std::vector<std::size_t> share_of_views(const std::vector<Camera>& cameras, int share, int shares);

/// The wanted views and those that they are compared with, increasing: whose stereo is computed.
/// @param sources  of every view (choose_sources)
/// Throws LogicError for views out of range.
std::vector<std::size_t> with_sources(const std::vector<std::size_t>& wanted,
                                      const std::vector<std::vector<int>>& sources);

}  // namespace atelier
