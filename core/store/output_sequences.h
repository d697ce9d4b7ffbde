#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/sequence_archive.h"
#include "core/store/stage.h"

namespace atelier {

/// One archive of every frame in a stage's result.
struct OutputSequence {
  std::string frames;  ///< folder of the frames' files inside the result: "garment/frames"
  /// Shared data of its meshes: sequence.h5 beside `frames`. None: there is none, as of scans, or
  /// the frames are no meshes (states that a simulation goes on from).
  std::optional<SequenceHeader> header;
};

/// A stage's way to write sequences: all files of a frame at once, when the frame is made. `make`
/// gives a frame's archives in the order of `sequences` (of a mesh without what the header has:
/// archive_of(mesh)); it is called, and its archives are kept, as in StageRun::each_frame, and the
/// headers follow when every frame is there. Returns what each_frame does.
///
/// Where all sequences are without a header, `make` may leave a frame out
/// (core/store/frame_left_out.h).
///
/// Throws LogicError where there are not as many archives as sequences, or the frames of a header
/// are not `frame_ids`.
bool output_sequences(StageRun& run, const std::vector<OutputSequence>& sequences,
                      const std::vector<int>& frame_ids,
                      const std::function<std::vector<Archive>(int frame_id)>& make);

}  // namespace atelier
