#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bodymodel/formats/marker_clip.h"
#include "bodymodel/motion_clip.h"
#include "core/options.h"

namespace atelier {

struct MarkerFitOptions {
  std::string subject;            ///< whose markers are taken of a file of several people
                                  ///< (marker_subject); "": of the one person that there is
  double noise = 0.005;           ///< m, what a marker is trusted to, [1e-4, 0.1]; 0.02 suits
                                  ///< keypoints of a detector
  double offset_freedom = 0.025;  ///< m by which a skin marker may be off its named place, [0, 0.2]
  bool limits = true;             ///< keep joints within the default human's limits
  int calibration_frames = 30;    ///< frames from which lengths and places are measured, [1, 1000]
  int rounds = 6;                 ///< of measuring and posing in turn, [1, 100]
};

OptionTable describe(MarkerFitOptions& options);

/// A person's motion found from markers.
struct MarkerFit {
  MotionClip clip;                   ///< the default human's 22 joints of the body, A-pose at rest,
                                     ///< with bones as long as the markers say; metres, Y up
  std::vector<std::string> used;     ///< names that were understood
  std::vector<std::string> unknown;  ///< names that were not, and were left out
  std::vector<double> rms;           ///< [N] m between markers and where the fit has them
};

/// Who is in a file of several subjects: a note of the one whose markers make a person, a warning
/// that names the people with their numbers of markers and how to ask for one. Nothing of one body.
std::optional<Finding> subjects_finding(const MarkerClip& clip);

/// The markers of the one person that are farther from the others than a person reaches, by name
/// ("motion-markers-reach"); nothing where there is none, or nobody.
std::optional<Finding> reach_finding(const MarkerClip& clip);

/// Inverse kinematics of a recorded person, so that markers become a motion like any other:
///  - of several subjects ("Ada:LASI", "Ball:1") the one whose markers make a person is taken;
///  - names say where each marker is (marker_names.h); which axis is up and, where the header's
///    unit gives no person, which unit, are guessed and said in the clip's findings; markers beyond
///    a person's reach are unseen, and said;
///  - on some frames bone lengths (equal left and right) and the places of skin markers are
///    solved by linear least squares, in turn with the poses;
///  - then every frame is posed by Levenberg-Marquardt within joint limits, starting from the frame
///    before, and again from a few plain poses where that fits badly (marker_pose.h).
/// Frames in which fewer than six markers are seen keep to the frame before. Hands and feet without
/// markers stay at rest. Throws DataError, with the names, for markers of several people, a subject
/// that is not there, and unless there are markers on the pelvis or hips and on the knee, ankle or
/// foot of both legs. About 2 ms a frame with 40 markers.
MarkerFit fit_markers(const MarkerClip& markers, const MotionOptions& motion = {},
                      const MarkerFitOptions& options = {});

}  // namespace atelier
