#pragma once

#include <filesystem>
#include <span>

#include "core/store/stage.h"
#include "core/store/workspace_status.h"
#include "pipeline/sealing/sealing_note.h"

namespace atelier {

/// The consent of a result, as its manifest has it and as its inputs from outside state it today,
/// where they are still there and may be looked at.
std::vector<Consent> consent_of(const StageStatus& status);

/// The note of a folder that is to be sealed, without time, purpose and reason: a workspace with
/// the consent of its current results, as the manifests and, where they are still there, the
/// captures say it; or an export, with the `consent.toml` of each of its folders. Without a kind
/// for anything else. Throws DataError for a damaged result.
SealingNote sealed_subject(const std::filesystem::path& folder, std::span<const Stage> stages);

/// Reads every file of a workspace's current results: throws DataError where one has other bytes
/// than its stage wrote.
void require_sound_files(const std::filesystem::path& folder, std::span<const Stage> stages);

}  // namespace atelier
