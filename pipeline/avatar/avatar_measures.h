#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// avatar.*: how far the seen surface, posed with its mean displacement, is from the true one
/// ("mean_mm", "hair_mm", "shoes_mm"), and how alike its images are to the true ones of held-out
/// cameras in held-out frames: "psnr_db", "static_psnr_db" of the skinned mean texture alone,
/// "gain_db", "head_hands_psnr_db", "ssim", "covered".
std::vector<Measure> measure_avatar(const std::filesystem::path& workspace,
                                    const std::filesystem::path& capture);

}  // namespace atelier
