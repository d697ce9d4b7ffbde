#pragma once

#include "core/render/prepared_scene.h"

namespace atelier {

inline constexpr int kMaxRays = 1024;

/// The area lights' shadows within `reach` metres of a place on the scene's ground, by `rays` (at
/// most kMaxRays) to each light from every point of a grid. The grid starts coarse; its squares
/// are halved where their middles are not what their corners say (our choice), down to 4 cm.
/// Private to core/render.
GroundShadows gathered_ground_shadows(const PreparedScene::Data& scene, float middle_x,
                                      float middle_z, float reach, int rays);

}  // namespace atelier
