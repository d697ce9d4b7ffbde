#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/types.h"
#include "pipeline/cloth/simulation_scene.h"

namespace atelier {

/// The moving body that wears a scene's garments: the vertices at whole frames of their own.
struct BodyTrack {
  Triangles faces;
  double fps = 0;
  Index count = 0;
  std::function<Points(Index)> at;
};

/// The vertices at any time [s], straight between frames; before the first and after the last as
/// they are there.
Points body_at(const BodyTrack& track, double time);

/// Reads the body of a scene that has one: a mesh, a folder of meshes, a sequence, a body model
/// that stands or, with a motion, goes from its rest pose into that. `notes` gets what its readers
/// found. Throws DataError for files that are none of these or do not fit each other, UsageError
/// for a motion of what cannot be posed.
BodyTrack read_body_track(const ScenePaths& paths, const SimulateOptions& options,
                          std::vector<std::string>& notes);

}  // namespace atelier
