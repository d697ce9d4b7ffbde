#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "bodymodel/formats/marker_clip.h"
#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

/// Reads TRC (Motion Analysis, OpenSim, Pose2Sim). Cells stand between tabs or, on a line without
/// tabs, between commas or blanks; empty cells, those that a row leaves out at its end, and the
/// words nan, NaN, NA, null or none are markers that were not seen, and so is 0, 0, 0 as
/// lose_markers_at_origin says. Values of the header may be lined up by more than one tab. Units m,
/// cm, mm, in as the header says, in any spelling (metres_of_unit). A Time column that is of
/// another rate than DataRate is said ("motion-rate"); where DataRate is 0 it is the rate. Frame
/// numbers that all go on by the same step are rows at DataRate over that step, unless Time says
/// otherwise, and become numbers that go on by 1; where Time jumps by whole frames and the numbers
/// do not, the numbers follow it. Numbers that are missing stay so.
///
/// Throws DataError, with the line, for a header that is not TRC's, a unit or rate that is none,
/// names that are missing or repeated, NumMarkers that is not the number of names and columns, a
/// row with more cells or a part of a marker, frames out of order, and NumFrames that is not the
/// number of rows.
MarkerClip read_trc(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits = {});
MarkerClip read_trc(const std::filesystem::path& path, const Limits& limits = {});

/// The joints of a motion as markers that bear their names (portable_names), metres, Y up.
MarkerClip joint_markers(const MotionClip& clip);

/// TRC text as OpenSim's reader demands it (TRCFileAdapter, 4.5): its eight keys in their order,
/// cells between tabs, X1 Y1 Z1, ... under the names, an empty line, frames from 1, time from 0;
/// metres to a micrometre, NaN where a marker was not seen. Numbers that frames skip, times skip
/// too. Throws LogicError for a clip without markers or frames, without a rate, or whose sizes do
/// not agree.
std::string trc_text(const MarkerClip& clip);
void write_trc(const std::filesystem::path& path, const MarkerClip& clip);

}  // namespace atelier
