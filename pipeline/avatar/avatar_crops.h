#pragma once

#include <functional>
#include <vector>

#include "appearance/appearance_model.h"
#include "appearance/prepare.h"
#include "core/render/contact_sheet.h"
#include "pipeline/avatar/avatar_input.h"

namespace atelier {

/// Details of images that an avatar was made from, each as it was taken and as it is drawn, in
/// squares of 512 pixels: heads, hands and feet in turn, at most 20 pairs.
/// @param subject  the seen surface first, and what is worn
/// @param file     the model's
/// @param read     an image, empty where nobody says what is the body's in it
std::vector<CaptionedImage> avatar_crops(const AvatarInput& input, const DressedSubject& subject,
                                         const AppearanceModel& model,
                                         const std::filesystem::path& file, const ReadPicture& read,
                                         Device device);

}  // namespace atelier
