#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "core/store/stage.h"
#include "pipeline/animation/animation_input.h"
#include "simulation/animated_frame.h"
#include "simulation/cloth/frame_report.h"

namespace atelier {

/// Diagnostics of cloth against the body's surface in one frame; a body's own overlaps do not
/// count.
FrameFigures frame_figures(const Animation& animation, const Points& cloth, const Points& body);

/// A frame of the result as `simulation_diagnostics` judges it. Edges of cloth and body that pierce
/// one another are not counted: in an armpit or a bent knee, where the body overlaps itself, they
/// have to. Cloth of another simulator has no strain, as its rest shape is not known.
FrameReport frame_report(const Animation& animation, int frame_id, const Points& cloth,
                         const FrameFigures& figures);

/// The cloth in every frame of the result: simulated in order, whoever asks for which, on from what
/// an earlier run has finished; or taken from another simulator. A frame is asked for once.
class AnimatedCloth {
 public:
  AnimatedCloth(StageRun& run, const Animation& animation) : run_(run), animation_(animation) {}

  /// The state in the row-th frame. Throws DataError where cloth is torn, StopRequested.
  ClothState at(Index row);

  double seconds_a_step() const { return steps_ > 0 ? seconds_ / steps_ : 0; }
  bool simulated() const { return steps_ > 0; }

 private:
  void start_before(Index row);
  void advance_to(int step);
  ClothState foreign_at(Index row) const;
  std::optional<std::filesystem::path> finished(Index row) const;

  StageRun& run_;
  const Animation& animation_;
  std::unique_ptr<Solver> solver_;
  std::mutex mutex_;
  int step_ = 0;
  Index next_ = 0;
  Points body_;
  std::map<Index, ClothState> waiting_;
  int steps_ = 0;
  double seconds_ = 0;
};

}  // namespace atelier
