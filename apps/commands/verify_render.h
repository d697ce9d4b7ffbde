#pragma once

#include <string>

#include "pipeline/sealing/consent_check.h"

namespace atelier {

/// Whether a file is an image (PNG, JPEG) or a video (MP4), by its first bytes. False for what is
/// no readable file.
bool is_image_or_video(const std::string& file);

/// Says in five lines what an image or video is: its credentials, who has consented to what, what
/// it was made of, whether it is as it was signed, and its mark. Returns kExitDone where it is
/// synthetic, whole, and its use is covered by consent; kExitCheckFailed where one of these does
/// not hold or nothing is known of it. Throws DataError for a damaged file.
int verify_render(const std::string& file, const ConsentUse& use);

}  // namespace atelier
