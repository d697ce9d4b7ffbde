#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// appearance.* of a workspace's result of `appearance` against a synthetic capture's truth: every
/// held-out camera in every held-out frame is drawn and compared with the image without noise, as
/// 8-bit sRGB, over the eroded pixels of the ground-truth garments that the model's geometry
/// covers, too; "covered" says how many these are. "simulated_psnr_db" is the same in a motion that
/// the capture does not show, where it can be played again (simulate_motion). "body_psnr_db" is
/// that of the body, where it has a network and the true one is in front. None where there is no
/// result.
std::vector<Measure> measure_appearance(const std::filesystem::path& workspace,
                                        const std::filesystem::path& capture);

/// oracle.*, the same of the result of `oracle`.
std::vector<Measure> measure_oracle(const std::filesystem::path& workspace,
                                    const std::filesystem::path& capture);

/// appearance.below_oracle_db: what registration costs, where both were measured. It has a target
/// where both were trained alike.
std::optional<Measure> below_oracle(const std::filesystem::path& workspace,
                                    std::span<const Measure> measures);

}  // namespace atelier
