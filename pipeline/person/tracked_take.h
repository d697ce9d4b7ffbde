#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodymodel/formats/tracked_motion.h"

namespace atelier {

/// The take of a capture that `track` followed: by its name, or the first that is clothed. Throws
/// DataError for a name that was not tracked.
std::filesystem::path tracked_take(const std::filesystem::path& tracked,
                                   const std::filesystem::path& capture, const std::string& name);

/// A sequence of the capture as `track` has left it.
struct TrackedTake {
  std::string name;
  TrackedMotion tracked;
};

/// All of them, in the order of their frames. @param tracked  the result of `track`
std::vector<TrackedTake> tracked_takes(const std::filesystem::path& tracked);

}  // namespace atelier
