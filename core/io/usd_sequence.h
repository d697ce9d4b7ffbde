#pragma once

#include <filesystem>
#include <string>

#include "core/sequence.h"

namespace atelier {

/// Writes a sequence over one topology as one USD text file (.usda): a Mesh prim of polygons whose
/// points are time samples, in metres, Y up, one time code a frame, with normals left to the reader
/// and no subdivision. Other programs open it as an animated mesh. Numbers are the shortest that
/// read back to the same float, the precision of USD's points. `name` becomes the prim's, with what
/// USD does not allow in names replaced by "_".
///
/// The file appears whole or not at all. Throws LogicError for a sequence without frames, shared
/// faces or frame rate, DataError from a frame that cannot be read, EnvironmentError if the file
/// cannot be written. Frames are read one at a time.
void write_usd_sequence(const std::filesystem::path& path, const Sequence& sequence,
                        const std::string& name = "garment");

}  // namespace atelier
