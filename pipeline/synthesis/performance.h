#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/io/ground_truth_archive.h"
#include "pipeline/outfit/dressing.h"
#include "pipeline/synthesis/performance_state.h"
#include "pipeline/synthesis/synthesis_options.h"
#include "pipeline/synthesis/synthetic_look.h"
#include "pipeline/synthesis/synthetic_subject.h"

namespace atelier {

/// A frame before it is photographed: where everything is, and how fast it moves (for blur).
struct PerformedFrame {
  GroundTruthFrame truth;
  Points body_velocity;                    ///< [V,3] m/s
  std::vector<Points> layer_velocities;    ///< as GroundTruthFrame::layers
  std::vector<Points> garment_velocities;  ///< as GroundTruthFrame::garments
};

/// A subject, its clothes and its motions.
struct Performance {
  SyntheticSubject subject;
  SubjectKeypoints keypoints;
  std::vector<WornLayer> layers;
  Outfit outfit;             ///< no garments: minimal alone
  ContinuousMotion clothed;  ///< feet on their soles
  ContinuousMotion minimal;
  double start = 0;  ///< s into the clothed motion of its first frame
  /// m, added to everything that is photographed clothed, so that a person who walks through a
  /// recorded motion passes the middle of the dome half way through the frames.
  Eigen::Vector3d shift{0, 0, 0};
};

/// Draws the subject, drapes the clothes, chooses the motions. Throws as make_subject, dress_body
/// and continuous_motion do. `dressed`: the clothes of an earlier cast of the same subject and
/// outfit; they are not draped again.
Performance cast_performance(const SynthesisOptions& options,
                             const std::vector<GroundTruthGarment>& dressed = {});

/// Makes the subject and reads what cast_performance would read, without draping anything; returns
/// what the motion's reader found. Throws as that does.
std::vector<Finding> require_cast(const SynthesisOptions& options);

/// The motion that the options name, "auto" by what is worn.
std::string motion_of(const SynthesisOptions& options);

/// Its ground truth in the capture, without cameras, lights and uvs of others.
GroundTruth truth_of(const Performance& performance, const SynthesisOptions& options);

/// Plays the minimal sequence: `take(i, frame)` for each frame in order.
void perform_minimal(const Performance& performance, const SynthesisOptions& options,
                     const std::function<void(int, const PerformedFrame&)>& take);

/// Plays the clothed sequence with its cloth simulated from the rest pose on; `take` gets each
/// frame in order with the state after it. `from` goes on from such a state with the same bits.
/// Throws DataError if the simulation breaks (the frame is named).
void perform_clothed(
    const Performance& performance, const SynthesisOptions& options, const PerformanceState* from,
    const std::function<void(int, const PerformedFrame&, const PerformanceState&)>& take);

}  // namespace atelier
