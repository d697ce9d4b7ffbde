#pragma once

#include <vector>

#include "core/render/studio.h"

namespace atelier {

/// An image of each subject in the studio, all by one camera, so that sizes compare: subjects are
/// moved level until the middles of their boxes are one, and stay at their heights; the camera sees
/// all of them. Throws LogicError without a subject, and as picture_of.
std::vector<Image> pictures_at_one_scale(std::vector<std::vector<RenderMesh>> subjects,
                                         const View& view = kThreeQuarter,
                                         const PictureOptions& options = {});

/// The same of meshes in clay.
std::vector<Image> pictures_at_one_scale(const std::vector<Mesh>& meshes,
                                         const View& view = kThreeQuarter,
                                         const PictureOptions& options = {});

}  // namespace atelier
