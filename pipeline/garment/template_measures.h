#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// template.* of a workspace's result of `template` against the cloth of the same frames in a
/// synthetic capture's ground truth; none where there is no result.
std::vector<Measure> measure_template(const std::filesystem::path& workspace,
                                      const std::filesystem::path& capture);

}  // namespace atelier
