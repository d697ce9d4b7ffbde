#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "registration/template/body_anatomy.h"
#include "registration/template/clothed_frames.h"
#include "registration/template/garment_cover.h"

namespace atelier {

/// How well one frame of a take shows a garment. Shares are from 0 to 1.
struct FrameScore {
  Index row = 0;        ///< of the frames
  double shown = 0;     ///< area of the garment's label, over that of the frame that shows most
  double at_hands = 0;  ///< share of that area within 8 cm of a hand or a bare forearm
  double folded = 0;    ///< share of it whose outside faces itself within 2.5 cm
  double facing = 0;    ///< share of the covered body that another limb faces within 5 cm
  double follow = 0;    ///< frames to the farther end of the take, 24 at most
  double score = 0;     ///< shown - at_hands / 3 - folded - facing - follow / 50: our choice
};

/// Visibility of a garment over many frames.
struct TakeOverview {
  std::vector<FrameScore> scores;  ///< of the frames that were looked at
  GarmentCover cover;              ///< of the body, by all of them
  double area = 0;                 ///< m2 of the label, in the frame that shows most
};

/// Looks at the frames in `rows`. Throws LogicError as check_anatomy.
TakeOverview take_overview(const ClothedFrames& frames, const std::vector<Index>& rows,
                           std::uint8_t label);

/// The best by score; the first of equals. Throws LogicError for an empty list.
const FrameScore& best_of(const std::vector<FrameScore>& scores);

/// "shows 98% of the most; 1% at hands, 3% folded; 0.91 of 0.62 to 0.91": a frame and what the
/// others have.
std::string score_text(const FrameScore& score, const std::vector<FrameScore>& all);

}  // namespace atelier
