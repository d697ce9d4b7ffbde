#pragma once

#include <functional>
#include <vector>

#include "appearance/appearance_model.h"
#include "core/render/contact_sheet.h"
#include "pipeline/avatar/avatar_drawing.h"
#include "pipeline/avatar/avatar_input.h"

namespace atelier {

/// Some of the images that an avatar was made from, as it is drawn in them.
struct ShownViews {
  std::vector<std::size_t> which;  ///< of the input's cameras, of each camera that is shown
  std::vector<int> frames;         ///< that are shown
  DrawnViews drawn;
};

/// Up to five cameras in up to four frames.
/// @param file     the model's
/// @param subject  the seen surface first, and what is worn
ShownViews shown_views(const std::filesystem::path& file, const AppearanceModel& model,
                       const AvatarInput& input, const DressedSubject& subject, Device device);

/// Three whole images, each as it was taken and as it is drawn.
/// @param read  an image, empty where nobody says what is the body's in it
std::vector<CaptionedImage> avatar_images(const ShownViews& shown, const AppearanceModel& model,
                                          const ReadPicture& read);

/// Details, each as it was taken and as it is drawn, in squares of 512 pixels: heads, hands and
/// feet in turn, at most 20 pairs.
/// @param read  as avatar_images
std::vector<CaptionedImage> avatar_crops(const ShownViews& shown, const AppearanceModel& model,
                                         const AvatarInput& input, const DressedSubject& subject,
                                         const ReadPicture& read);

}  // namespace atelier
