#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "bodymodel/formats/marker_clip.h"
#include "core/limits.h"

namespace atelier {

/// Reads the 3D points of a C3D file (c3d.org's user guide, 2008; Vicon, Qualisys, Motion Analysis,
/// CMU): integer and floating-point coordinates, numbers of Intel, MIPS (SGI) and DEC machines.
/// Names are POINT:LABELS, LABELS2, ...; unnamed markers ("*12") and further points are left out,
/// and so are points that are no places, since POINT:ANGLES, FORCES, MOMENTS, POWERS, SCALARS or
/// REACTIONS name them. A residual below 0 and coordinates that are not finite are a marker that
/// was not seen, and so is 0, 0, 0 as lose_markers_at_origin says. Analog channels, events and
/// force plates are passed over. The unit is POINT:UNITS, millimetres where there is none. The rate
/// is POINT:RATE; a header that has another is said ("motion-rate").
///
/// A file without points whose group ROTATION holds segments as 4 x 4 matrices (Theia3D; c3d.org,
/// "The ROTATION group") gives two points for each: its origin under the segment's name, a joint's
/// centre, and "NAME.y", 0.1 m from there along its second axis, which Theia3D has point ahead. The
/// world's own segment is left out.
///
/// The header's 16 bits end at frame 65,535: TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD,
/// POINT:LONG_FRAMES and a real POINT:FRAMES go before it; of counts that differ, the one that
/// fills the file. What else the file holds is said ("motion-frames").
///
/// Parameters whose offsets lead nowhere are read on behind their own ends ("c3d-parameters"); of
/// names that are there twice the first counts ("motion-markers-names").
///
/// Throws DataError, with the byte, for a file that is no C3D, counts or blocks beyond the file, a
/// unit or rate that is none, no named point or segment, matrices that are no segment's,
/// coordinates beyond `limits.mesh_coordinate`.
MarkerClip read_c3d(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits = {});
MarkerClip read_c3d(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
