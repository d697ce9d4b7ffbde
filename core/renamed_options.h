#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// The present name of an option that was renamed: "hull.voxel_size" of "hull.cell", and
/// "reconstruct.hull.voxel_size" of "reconstruct.hull.cell". Former names are understood for one
/// release. Returns "" if `name` is no former name of one of `known`.
std::string renamed_option(std::string_view name, const std::vector<std::string>& known);

/// The present spelling of a value of a choice that was renamed: "oracle" of "ceiling". Returns ""
/// if `value` is no former spelling of one of `choices`.
std::string renamed_choice(std::string_view value, const std::vector<std::string>& choices);

/// The present name of a stage or command that was renamed: "oracle" of "ceiling"; "" of any other.
std::string renamed_stage(std::string_view name);

/// The present name of a stage's figure that was renamed: "deviation_max" of "gave_way_most"; the
/// name itself of any other.
std::string present_metric(std::string_view name);

/// The other way round of renamed_stage(): "ceiling" of "oracle"; "" of a stage that was never
/// renamed.
std::string former_stage(std::string_view name);

}  // namespace atelier
