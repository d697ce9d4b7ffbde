#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "bodymodel/formats/tracked_motion.h"
#include "core/store/stage.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

/// Whose figures are added, and what its numbers mean.
struct FigureSource {
  std::string stage;
  std::span<const StageMetric> metrics = {};
};

/// Adds the numbers of a file {"frames": {"000000": {"name": 1.5}}} as series, or of one that has
/// such an object for each garment; none where there is no file. Throws DataError.
void add_figures_file(ViewTimeline& timeline, const std::filesystem::path& file,
                      const FigureSource& source);

/// Adds the columns of a table (.csv) whose first two are the frame and the time; none where there
/// is no file. Throws DataError.
void add_table(ViewTimeline& timeline, const std::filesystem::path& file,
               const FigureSource& source);

/// Adds how sure the poses of a track are, frame by frame, and a mark for each run of frames that
/// were bridged.
void add_track(ViewTimeline& timeline, const TrackedMotion& tracked);

}  // namespace atelier
