#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// body.* of a workspace's underlying bodies against a synthetic capture's ground truth, over the
/// frames that wear garments; none where there is no result. Targets are those of the scans that
/// they were made from.
std::vector<Measure> measure_body(const std::filesystem::path& workspace,
                                  const std::filesystem::path& truth);

/// refine.*: the same of what was repeated against a registered garment.
std::vector<Measure> measure_refine(const std::filesystem::path& workspace,
                                    const std::filesystem::path& truth);

}  // namespace atelier
