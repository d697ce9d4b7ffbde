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
  Auto,    ///< what swings, found from how its gap to the body varies over time
  Labels,  ///< garments by label: the caller marks their points ScanPart::LeftOut
  Region,  ///< clothing over TrackOptions::region
  None,    ///< none
};

struct TrackOptions {
  Exclude exclude = Exclude::Auto;
  FrameWeights weights;
  MotionWeights motion;
  DynamicOptions dynamic;
  int samples = 2000;          ///< points of each scan in an iteration, [0, 1e7]; 0: all
  double model_to_scan = 0.5;  ///< share of what skin says that is asked from the body's side: the
                               ///< nearest point of the scan for its vertices, [0, 1]; 0: only the
                               ///< nearest point of the body for those of the scan
  int rounds = 5;              ///< of matching with scans, [0, 100]
  int window = 12;             ///< frames solved jointly, [3, 1000]
  int overlap = 4;             ///< frames that neighbouring windows share, [0, window / 2]
  int iterations = 1;          ///< of the solver in a round, [1, 1000]
  bool fingers = false;        ///< seek them too; only with keypoints of the hands or close-ups
};
OptionTable describe(TrackOptions& options);

/// One frame of a sequence: keypoints in space, a scan, or both. What is missing is empty.
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

/// "3, 5, 8": the numbers of frames that a finding is about, the ninth and later counted alone.
std::string listed_frames(const std::vector<int>& ids);

/// Follows a person through a sequence (methods: seed, "Base Body Avatars"; Xiang et al. 2021):
///  - every frame starts from its keypoints alone, in any pose, with left and right put right where
///    detectors mixed them up (start_pose.h);
///  - windows of frames are solved jointly (solve_window.h) to keypoints, joint limits, the pull to
///    rest and accelerations;
///  - then scans: points of the scan to planes of the body, and of skin also vertices of the body
///  to
///    planes of the scan, matched anew in every round; clothing so that the body lies inside;
///  - with Exclude::Auto, after the skin has been fitted, clothing whose gap to the body swings is
///    found (dynamic_region.h) and left out of the rounds that follow; it is found again once.
/// Stated behaviour for bad input, each with a finding: a frame without (or with contradictory)
/// keypoints starts between its neighbours, is fitted to its scan if it has one, and is trusted
/// only if that bears out every limb (scan_agreement.h), else its deviations are at least as far as
/// limbs and scan are apart; so does one whose keypoints are no person's in metres
/// (keypoint_unit.h); without a scan deviations hold what keypoints may be off by in all frames
/// alike (detector_bias.h); a frame whose pose ends 6 cm (rms) or more from the keypoints that
/// its start met is not trusted, and its deviations are at least that; scans more than 3 times as
/// large or small as the person (millimetres) are left out; points further than 8 cm from the body
/// (a second person) are not of it. Results do not depend on the number of threads. Throws
/// LogicError on sizes that do not agree, DataError for a body that is no person. O(frames x rounds
/// x samples).
/// @param model  the person, without shape parameters or at its neutral shape
Tracking track(const BodyModel& model, const TrackInput& input, const TrackOptions& options = {});

}  // namespace atelier
