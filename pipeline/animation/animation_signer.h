#pragma once

#include <optional>

#include "core/store/stage.h"
#include "pipeline/sealing/signed_render.h"

namespace atelier {

/// What the images and the video of an animation say of themselves, as JSON: its SHA-256 begins
/// with their mark.
inline constexpr const char* kAnimationStatement = "statement.json";

/// By which images and video say what they are; nothing with --mark false. Throws DataError for a
/// wrong --sign.
/// @param by_networks  whether networks draw them
std::optional<SignedRender> animation_signer(StageRun& run, bool by_networks);

/// Appends to the workspace's log that it was drawn, for what and with which mark. A log that
/// cannot be written is a warning.
void log_animation(StageRun& run, const std::optional<SignedRender>& signer);

}  // namespace atelier
