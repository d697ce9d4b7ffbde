#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "bodymodel/underlying/underlying_body.h"

namespace atelier {

/// One frame's personal body and scan.
struct PosedScan {
  Points posed;      ///< [V,3] metres
  ScanSurface scan;  ///< empty: there is none
};

struct UnderlyingSequenceOptions {
  UnderlyingBodyOptions body;
  CoverOptions cover;
  int cover_frames = 24;  ///< frames, spread evenly, that tell what is covered; 1..10000
  int gap_frames = 4;     ///< of these, fitted beforehand to find the cloth's usual gap; 0..1000
  int around = 2;         ///< frames before and after whose offsets shape a frame; 0..100
};
OptionTable describe(UnderlyingSequenceOptions& options);

/// The underlying bodies of a sequence, frame by frame in any order and from any thread (but not
/// from inside a parallel_for, whose threads could wait for each other): every
/// frame's result is the same whichever others are asked for. A frame is fitted on its own first,
/// then once more with the mean offsets of the frames around it, each vertex those of the frames
/// that saw it; frames without a scan are left out.
class UnderlyingSequence {
 public:
  /// Looks at cover_frames of the frames.
  /// @param load  frame in [0, count); may be called from several threads and more than once
  /// Throws LogicError for a negative count, and what `load` throws.
  UnderlyingSequence(Triangles faces, Index count, std::function<PosedScan(Index frame)> load,
                     const UnderlyingSequenceOptions& options = {});

  const BodyCover& cover() const { return cover_; }

  /// Throws LogicError for a frame out of range, and what `load` throws.
  UnderlyingBody at(Index frame) const;

 private:
  struct Alone;  // a frame's offsets, fitted on its own

  const Alone& alone(Index frame) const;
  Points usual_offsets(Index frame) const;

  Triangles faces_;
  std::function<PosedScan(Index)> load_;
  UnderlyingSequenceOptions options_;
  BodyCover cover_;
  std::vector<std::shared_ptr<Alone>> alone_;
};

/// The cover that follows from all frames, and the distance of cloth: see
/// UnderlyingSequenceOptions.
BodyCover sequence_cover(const Triangles& faces, Index count,
                         const std::function<PosedScan(Index frame)>& load,
                         const UnderlyingSequenceOptions& options = {});

}  // namespace atelier
