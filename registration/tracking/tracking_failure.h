#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/finding.h"

namespace atelier {

/// Diagnostics of a registered frame.
struct TrackedFrameFigures {
  int frame_id = 0;
  double support = 0;      ///< share of the garment's area that has a scan near it
  double correlation = 0;  ///< of images with the template's texture; 0: nothing was compared
  double inside = 0;       ///< share of vertices and triangles' centres inside the body
};

/// The frames in which a garment was lost, as one warning `tracking-failure`; nothing where it was
/// followed in all. Less than 0.75 of its area then has a scan near it, or images correlate with
/// its texture by less than 0.4. Garments that were followed had 0.80 and, without a print, 0.47 at
/// least; a plainly woven skirt had 0.32 where it had slid by 6.5 mm on average, a dress that was
/// lost 0.67 and 0.18 at most (docs/results/registration.md).
std::optional<Finding> tracking_failure(const std::string& garment,
                                        std::span<const TrackedFrameFigures> frames);

/// The frames in which more than 1% of a garment is inside the body, as one warning `inside-body`;
/// nothing where there is none. Our choice: a body that pokes through so much cloth is seen in a
/// film.
std::optional<Finding> inside_body(const std::string& garment,
                                   std::span<const TrackedFrameFigures> frames);

}  // namespace atelier
