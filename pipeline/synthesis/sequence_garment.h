#pragma once

#include <vector>

#include "core/ground_truth.h"
#include "core/io/mesh_sequence_file.h"

namespace atelier {

/// A garment of a sequence of cloth that another program made.
struct SequenceGarment {
  GroundTruthGarment truth;  ///< without panels and seams where the file does not tell them
  std::vector<int> rows;     ///< [V] the file's vertex that each of the mesh's is
};

/// The garment of a sequence, in its first frame. Its texture coordinates are its panels where they
/// lie flat at one scale (nine tenths of the edges within a third of the median ratio to their
/// length in the first frame; metres if that is within a tenth of 1, else scaled to it): then edges
/// whose sides lie in different places of the texture are seams, and boundary vertices that
/// coincide (within 0.1 mm in the first, the middle and the last frame), as simulators that sew
/// panels keep them, are joined to one. Our choice.
SequenceGarment sequence_garment(const MeshSequenceFile& cloth);

}  // namespace atelier
