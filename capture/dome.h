#pragma once

#include <vector>

#include "core/camera.h"
#include "core/options.h"
#include "core/random.h"

namespace atelier {

/// Cameras round a subject that stands at the origin. They stand on posts evenly round a circle;
/// each post carries one camera, a pair side by side, or two pairs one above the other.
struct DomeOptions {
  int cameras = 16;        ///< in all, 2 to 1024; pairs need an even number
  bool pairs = true;       ///< cameras of a post stand side by side for stereo
  int rows = 1;            ///< pairs (or cameras) one above the other on each post, 1 or 2
  double pair_angle = 15;  ///< degrees round the subject between the two of a pair, 1 to 90
  double radius = 3.4;     ///< m from the axis to the posts, 1 to 50
  double low = 0.5;        ///< m, lowest camera; posts alternate between low and high
  double high = 2.4;       ///< m, highest camera
  double reach = 2.4;      ///< m of height that fills an image at the axis, 0.1 to 20
  double aim = 0.95;       ///< m above the ground that cameras look at
  int width = 800;         ///< pixels
  int height = 1000;       ///< pixels
  double distortion = 1;   ///< share of a common lens's distortion (k1 -0.08, k2 0.03), 0 to 3
  double jitter = 1;       ///< share of the scatter of a hand-built rig (2 cm, 1 degree), 0 to 10
  double gain = 0.05;      ///< spread of exposure, and 0.6 of it of white balance, 0 to 0.5
};
OptionTable describe(DomeOptions& options);

/// The true cameras, with ids "00", "01", ... round the dome. Throws LogicError for options out of
/// range, an odd number of cameras in pairs, or cameras that do not fill the posts.
std::vector<Camera> dome_cameras(const DomeOptions& options, Random random);

/// The same cameras as a calibration finds them: intrinsics, distortion and pose are off, so that
/// points of the capture volume (2.4 m tall, 1.2 m wide) project `rms` pixels off (root mean square
/// over points). Gains become 1: a calibration of geometry knows no colours.
std::vector<Camera> calibrated_cameras(const std::vector<Camera>& cameras, double rms,
                                       Random random);

/// Root mean square distance, pixels, between the projections of the capture volume's points.
double reprojection_rms(const Camera& a, const Camera& b);

}  // namespace atelier
