#pragma once

#include <filesystem>
#include <vector>

#include "appearance/appearance_colors.h"
#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/prepare.h"
#include "core/image.h"

namespace atelier {

/// The model in a result of `avatar`. Throws DataError where it is damaged.
AppearanceModel avatar_model_at(const std::filesystem::path& file);

/// Colours of every pixel of `asked` by a model: `fixed` by its mean texture; `drawn` as
/// `atelier-appearance` draws them, where that program is there, else as the mean texture.
AppearanceColors avatar_colors(const std::filesystem::path& file, const AppearanceModel& model,
                               const AppearanceData& asked);

/// A subject's avatar as cameras see it in some frames.
struct DrawnViews {
  AppearanceData asked;     ///< a view for each frame and camera that sees it, without its colours
  AppearanceColors colors;  ///< of all their pixels, one view behind the other
};

/// Draws the first surface of a subject, with light transfer as the model learnt from.
/// @param file    the model's
/// @param frames  of the subject
DrawnViews drawn_views(const std::filesystem::path& file, const AppearanceModel& model,
                       const DressedSubject& subject, const std::vector<Camera>& cameras,
                       const std::vector<int>& frames, Device device);

/// A view's pixels in their colours, in place of those of an image in linear light.
/// @param first  of the view's pixels among all
/// @param gain   of the camera, a channel each
Image with_drawn_pixels(Image picture, const AppearanceView& view, const std::vector<float>& colors,
                        std::size_t first, const Eigen::Vector3d& gain);

}  // namespace atelier
