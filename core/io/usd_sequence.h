#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/sequence.h"

namespace atelier {

/// A sequence with the name that its prim gets; what USD does not allow in names becomes "_".
struct NamedSequence {
  std::string name;
  Sequence sequence;
};

/// Writes sequences over one topology each as one USD text file (.usda): below the Xform "root" a
/// Mesh prim of triangles for each, whose points and extent are time samples (and by default those
/// of the first frame), in metres, Y up, one time code a frame, seen from both sides, with normals
/// left to the reader and no subdivision. Other programs open it as animated
/// meshes. Numbers are the shortest that read back to the same float, the precision of USD's
/// points.
///
/// The file appears whole or not at all. Throws LogicError for a sequence without frames, shared
/// faces or frame rate, of another frame rate than the first or of its name, DataError from a frame
/// that cannot be read, EnvironmentError if the file cannot be written. Frames are read one at a
/// time.
void write_usd_sequences(const std::filesystem::path& path,
                         std::span<const NamedSequence> sequences);

/// One alone.
void write_usd_sequence(const std::filesystem::path& path, const Sequence& sequence,
                        const std::string& name = "garment");

}  // namespace atelier
