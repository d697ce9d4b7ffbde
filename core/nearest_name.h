#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// The known name that `name` most likely means: the smallest number of inserted, deleted,
/// replaced or swapped letters (optimal string alignment distance), at most a third of the longer
/// name; for dotted names (or flags), one whose last word is the same
/// also counts; of "gpu" it is "cuda". Capitals are as good as small letters. "" if none is near.
/// Ties go to the first. Cost: product of the lengths, for each known name.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

/// ", did you mean 'x'?" or "" if nothing is near: the end of a message about an unknown name.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& known);

}  // namespace atelier
