#pragma once

#include <filesystem>
#include <span>

#include "capture/dataset.h"
#include "core/store/workspace_status.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

/// Kind of the data at a path.
enum class ViewKind { Workspace, Capture, Sequences, MeshFrames, Mesh };

/// Tells it by the files that are there. Throws DataError for anything else, with what is taken.
ViewKind view_kind(const std::filesystem::path& place, std::span<const Stage> stages);

/// Refuses a folder that no layout of captures fits, with what is taken, or with a place in it that
/// is. Throws DataError.
void require_capture(const std::filesystem::path& place);

/// The cameras of a capture and their images. Throws DataError for one without images or without
/// calibrated cameras.
ViewScene view_of_capture(Dataset dataset);

}  // namespace atelier
