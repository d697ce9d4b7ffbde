#pragma once

#include <memory>

#include "core/render/prepared_scene.h"

namespace atelier {

/// What `prepare` makes, while it may still be changed. Private to core/render.
std::shared_ptr<PreparedScene::Data> prepared_data(const Scene& scene,
                                                   const PrepareOptions& options,
                                                   const PreparedTextures& textures);

}  // namespace atelier
