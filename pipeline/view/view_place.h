#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/store/workspace_status.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

/// What is at a place that somebody names.
enum class ViewKind { Workspace, Capture, Sequences, MeshFrames, Mesh };

/// Tells it by the files that are there. Throws DataError for anything else, with what is taken.
ViewKind view_kind(const std::filesystem::path& place, std::span<const Stage> stages);

/// Refuses a folder that no layout of captures fits, with what is taken, or with a place in it that
/// is. Throws DataError.
void require_capture(const std::filesystem::path& place);

/// The current results of a workspace: of the capture its scans, body, garments and avatar with the
/// cameras, where the capture is still there; the simulated garments on their body; the animated
/// avatar. What is damaged or cannot be shown is a note. Throws DataError where there is nothing to
/// show.
ViewScene view_of_workspace(const std::filesystem::path& workspace,
                            std::span<const StageStatus> stages);

/// The cameras of a capture and their images. Throws DataError for one without images or without
/// calibrated cameras.
ViewScene view_of_capture(Dataset dataset);

/// Every sequence in a folder, or the one that it is; a file sequence.h5 is that of its folder.
/// Throws DataError.
ViewScene view_of_sequences(const std::filesystem::path& place);

/// What a finding says of where it is: the number of a frame ("frame 12", "000012.png") of those
/// there are, and the camera whose id stands in it.
ViewMark mark_of(Severity severity, const std::string& text, const std::string& stage,
                 const std::vector<int>& frame_ids, const std::vector<std::string>& cameras);

}  // namespace atelier
