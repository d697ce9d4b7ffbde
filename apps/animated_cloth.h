#pragma once

#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_CORE_RENDER)

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>

#include "apps/animated_frame.h"
#include "apps/animation_input.h"
#include "core/store/stage.h"

namespace atelier {

/// What one frame says of the cloth on the body's surface; a body's own overlaps do not count.
FrameFigures frame_figures(const Animation& animation, const Points& cloth, const Points& body);

/// The cloth in every frame of the result: simulated in order, whoever asks for which, on from what
/// an earlier run has finished; or taken from another simulator. A frame is asked for once.
class AnimatedCloth {
 public:
  AnimatedCloth(StageRun& run, const Animation& animation) : run_(run), animation_(animation) {}

  /// The state in the row-th frame. Throws DataError where cloth is torn.
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
  std::optional<ClothSolver> solver_;
  std::mutex mutex_;
  int step_ = 0;
  Index next_ = 0;
  Points body_;
  std::map<Index, ClothState> waiting_;
  int steps_ = 0;
  double seconds_ = 0;
};

}  // namespace atelier

#endif
