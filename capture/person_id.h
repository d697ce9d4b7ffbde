#pragma once

#include <cstdint>

namespace atelier {

/// The largest id of a person that files of keypoints may give; -1 says that there is none.
inline constexpr std::int64_t kMaxPeople = 1'000'000;

}  // namespace atelier
