#pragma once

#include <string>
#include <vector>

namespace atelier {

/// "3, 7, 8": frame numbers for a finding's place; of more than eight, how many others there are.
std::string listed_frames(const std::vector<int>& ids);

}  // namespace atelier
