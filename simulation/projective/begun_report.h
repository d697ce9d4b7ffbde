#pragma once

#include "simulation/cloth/frame_report.h"

namespace atelier {

/// The report of a frame, without figures yet: the residuals of XPBD's constraints are -1, as there
/// are none.
inline FrameReport begun_report(std::int64_t frame) {
  FrameReport report;
  report.frame = frame;
  report.spring_residual = -1;
  report.hinge_residual = -1;
  return report;
}

}  // namespace atelier
