#pragma once

#include <functional>

#include "core/io/mesh_sequence_file.h"
#include "pipeline/synthesis/performance.h"
#include "pipeline/synthesis/sequence_garment.h"
#include "pipeline/synthesis/sequence_person.h"

namespace atelier {

/// A performance that another program made: bodies, and cloth on them, from files.
struct FilePerformance {
  MeshSequenceFile body;
  MeshSequenceFile cloth;  ///< no faces: none
  SequencePerson person;
  SequenceGarment garment;            ///< its label by where it hangs on the first body
  Eigen::RowVector3d shift{0, 0, 0};  ///< m, brings the first body over the origin, on the ground
};

/// Reads the files that the options name. Throws as read_mesh_sequence does, and DataError for
/// cloth of fewer frames than its bodies, fewer frames than the options want, or bodies whose
/// labels are all background, of which every mask would be empty.
FilePerformance read_performance(const SynthesisOptions& options);

/// As the functions of performance.h.
GroundTruth truth_of(const FilePerformance& performance, const SynthesisOptions& options);
PerformedFrame performed_frame(const FilePerformance& performance, const SynthesisOptions& options,
                               int i, bool clothed);

}  // namespace atelier
