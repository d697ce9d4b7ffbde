#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/pattern/flatten_stage.h"
#include "registration/flattening/flatten_surface.h"
#include "registration/flattening/flatten_watcher.h"

namespace atelier {

/// Refuses, before the work, a body or registered sequences that cannot be all of these garments':
/// a mesh as the body of garments that `template` made in several frames, bodies of a sequence for
/// a garment of which nobody says the frame or that have none of it, one garment's registered
/// sequence for several, a folder of sequences that lacks one. Nothing where nothing is to be
/// relaxed. Throws DataError.
void require_relaxable(const FlattenStageOptions& options,
                       const std::vector<FlattenGarment>& garments);

/// The waist of what is worn on the hips, which a belt or its elastic holds where it is; without,
/// the weight would pull it down the hips. Nothing of what hangs from the shoulders.
std::vector<int> held_waist(const Mesh& mesh, const Mesh& body);

/// The body that a garment hangs on, at `place`: the mesh, in `convention`, or of a sequence of
/// bodies the one of its frame. Throws DataError where there is none.
Mesh body_of(const std::string& place, const MeshConvention& convention,
             const std::optional<int>& frame_id);

/// The unloaded garment that hangs as captured. Where none is found, the mesh stays as it is, with
/// a warning `not-relaxed` or `in-motion`: a garment that hangs elsewhere would be another one's
/// pattern. False then.
/// @param mesh  of the garment, as its file has it
///
/// Throws DataError as require_relaxable, and for a sequence of another mesh.
bool relax_mesh(Mesh& mesh, const FlattenGarment& of, const FlattenStageOptions& options,
                const FlattenWatcher& watcher);

}  // namespace atelier
