#pragma once

#include <string>
#include <vector>

#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/tracking/dynamic_region.h"
#include "bodymodel/tracking/scan_match.h"
#include "bodymodel/tracking/solve_window.h"
#include "core/finding.h"

namespace atelier {

/// Which clothing the surface term leaves out.
enum class Exclude {
  Auto,    ///< dynamic clothing, detected by the variation of its distance to the body over time
  Labels,  ///< garments by label: the caller marks their points ScanPart::LeftOut
  Region,  ///< clothing over TrackInput::region
  None,    ///< none
};

struct TrackOptions {
  Exclude exclude = Exclude::Auto;
  FrameWeights weights;
  MotionWeights motion;
  DynamicOptions dynamic;
  int samples = 2000;          ///< points of each scan in an iteration, [0, 1e7]; 0: all
  double model_to_scan = 0.5;  ///< share of skin's correspondences that go from body vertices to
                               ///< the nearest points of the scan, [0, 1]; the others go from scan
                               ///< points to the nearest points of the body
  int rounds = 5;              ///< of ICP correspondences with scans, [0, 100]
  int window = 12;             ///< frames solved jointly, [3, 1000]
  int overlap = 4;             ///< frames that neighbouring windows share, [0, window / 2]
  int iterations = 1;          ///< of the solver in a round, [1, 1000]
  bool fingers = false;        ///< estimate them too; needs keypoints of the hands or close-ups
};
OptionTable describe(TrackOptions& options);

/// One frame of a sequence: 3D keypoints, a scan, or both. Missing data are empty.
struct TrackFrame {
  Points keypoints;            ///< [K,3] metres, in order of TrackInput::keypoint_names
  Eigen::VectorXd deviations;  ///< [K] metres, standard deviation; 0: not seen
  ScanPoints scan;
};

struct TrackInput {
  std::vector<std::string> keypoint_names;  ///< [K] "left_knee", ... (keypoint_places.h)
  double fps = 0;                           ///< frames per second
  std::vector<int> frame_ids;               ///< [F] increasing
  std::vector<TrackFrame> frames;           ///< [F]
  std::vector<char> region;  ///< [V] 1 where clothing is left out (Exclude::Region), or empty
};

struct Tracking {
  TrackedMotion tracked;
  std::vector<Finding> findings;  ///< "keypoints-missing", "keypoint-unit", "frame-untrusted",
                                  ///< "left-right", "keypoints-unmet", "scan-unit", "scan-far",
                                  ///< "labels-absent"
};

/// Estimates a person's pose in every frame of a sequence (after Xiang et al. 2021 and the
/// supplement of "Dressing Avatars"):
///  - every frame is initialised from its keypoints alone, in any pose; where detectors confused
///    left and right, they are exchanged (start_pose.h);
///  - windows of frames are solved jointly (solve_window.h): keypoints, joint limits, rest-pose
///    prior and accelerations;
///  - then with scans: point-to-plane correspondences from scan to body and, for skin, from body to
///    scan, found again in every round; clothing only keeps the body inside;
///  - with Exclude::Auto, after the skin has been fitted, dynamic clothing is detected
///    (dynamic_region.h) and left out of the following rounds; it is detected again once.
///
/// Behaviour on bad input, each with a finding:
///  - a frame with missing or contradictory keypoints, or keypoints that are not a person's in
///    metres (keypoint_unit.h), starts between its neighbours and is fitted to its scan if it has
///    one. It is trusted only if the scan confirms every limb (scan_agreement.h); otherwise its
///    standard deviations are at least the distance between limbs and scan;
///  - without scans, standard deviations include systematic detector bias (detector_bias.h);
///  - a frame with a pose that ends 6 cm (rms) or more from keypoints that its initial pose fits is
///    not trusted, and its standard deviations are at least that distance;
///  - scans more than 3 times as large or small as the person (millimetres) are left out;
///  - scan points farther than 8 cm from the body (a second person) are ignored.
///
/// Results do not depend on the number of threads. Throws LogicError on sizes that do not agree,
/// DataError for a body that is not a person. O(frames x rounds x samples).
/// @param model  the person, without shape parameters or at its neutral shape
Tracking track(const BodyModel& model, const TrackInput& input, const TrackOptions& options = {});

}  // namespace atelier
