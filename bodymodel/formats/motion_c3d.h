#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "bodymodel/formats/motion_trc.h"
#include "core/limits.h"

namespace atelier {

/// Reads the 3D points of a C3D file (c3d.org's user guide, 2008; Vicon, Qualisys, Motion Analysis,
/// CMU): integer and floating-point coordinates, little-endian (Intel) and big-endian (MIPS)
/// numbers. Names are POINT:LABELS, without a subject before a colon where every name has the same;
/// unnamed markers ("*12") and further points are left out; a residual below 0 is a marker that was
/// not seen. Analog channels, events and force plates are passed over. The unit is POINT:UNITS,
/// millimetres where there is none.
///
/// Throws DataError, with the byte, for a file that is no C3D, DEC (VAX) numbers, counts or blocks
/// beyond the file, a unit or rate that is none, no named point, names that are there twice,
/// coordinates that are not finite.
MarkerClip read_c3d(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits = {});
MarkerClip read_c3d(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
