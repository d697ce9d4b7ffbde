#pragma once

#include "appearance/appearance_data.h"
#include "appearance/static_fit.h"
#include "core/store/stage.h"

namespace atelier {

/// Warns of cameras whose images contradict the geometry (contradicting_cameras), as where those of
/// two cameras were exchanged.
void tell_contradictions(StageRun& run, const AppearanceData& data, const StaticFit& fit);

}  // namespace atelier
