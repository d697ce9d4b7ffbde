#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

/// Reads Acclaim ASF (skeleton) and AMC (motion), as the CMU database has them. A joint is where
/// its bone begins and has the bone's name; a bone's rotation is C M C^-1, C from its `axis`, M
/// from its degrees of freedom. Skeletons of other orders of axes, degrees or radians are fine.
///
/// AMC files have no frame rate: `options.fps`, or 120 (CMU's) with a finding ("motion-fps").
///
/// Throws DataError, with the line, for: unknown sections or fields, a bone without direction,
/// length or axis, a parent that is unknown or comes twice, degrees of freedom other than rx, ry,
/// rz (root: also tx, ty, tz), bones of the motion that the skeleton does not have, bones missing
/// in a frame, more or fewer values than degrees of freedom, frames out of order, numbers that are
/// not finite, and counts beyond `limits`.
MotionClip read_amc(std::span<const std::byte> asf, const std::string& asf_name,
                    std::span<const std::byte> amc, const std::string& amc_name,
                    const MotionOptions& options = {}, const Limits& limits = {});
MotionClip read_amc(const std::filesystem::path& asf, const std::filesystem::path& amc,
                    const MotionOptions& options = {}, const Limits& limits = {});

}  // namespace atelier
