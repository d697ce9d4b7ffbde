#pragma once

#include <map>
#include <optional>
#include <vector>

#include "core/store/stage.h"
#include "pipeline/cloth/simulation_scene.h"

namespace atelier {

/// How far a simulated frame is from what was captured.
struct WatchedFrame {
  double strain_p999 = 0;    ///< of |length / rest - 1| over the mesh edges
  double captured = -1;      ///< m, mean distance from the captured cloth; -1: not captured then
  std::vector<double> away;  ///< m, of what holds the garments (ring_distance)
};

/// Looks at the frames of a scene beside what it was captured as. May be asked by several threads.
class SceneWatch {
 public:
  /// Throws DataError where the captured cloth is of another topology.
  SceneWatch(const SimulationScene& scene, const Cloth& cloth, const ScenePaths& paths,
             const SimulateOptions& options);

  WatchedFrame at(Index frame, const Points& positions) const;

 private:
  const SimulationScene& scene_;
  const Cloth& cloth_;
  std::optional<Sequence> captured_;
  std::map<Index, Index> rows_;  ///< of `captured_`, by the simulated frames of the same moment
};

/// Metrics of all frames, the first one's number being 1, and warnings of garments that left their
/// place.
void tell_watched(StageRun& run, const SimulationScene& scene,
                  const std::vector<WatchedFrame>& frames);

}  // namespace atelier
