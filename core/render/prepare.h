#pragma once

#include <memory>

#include "core/render/prepared_scene.h"

namespace atelier {

/// The result of `prepare`, while it is being built. Private to core/render.
std::shared_ptr<PreparedScene::Data> prepared_data(const Scene& scene,
                                                   const PrepareOptions& options,
                                                   const PreparedTextures& textures);

}  // namespace atelier
