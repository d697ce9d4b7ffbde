#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/device.h"
#include "core/image.h"
#include "core/options.h"

namespace atelier {

/// One camera's image, prepared for stereo.
struct StereoView {
  Camera camera;     ///< without distortion (see undistorted_view)
  Image image;       ///< [H,W,1] in [0,1], gamma-coded
  Image near_depth;  ///< [H,W,1] metres: the surface is not nearer; 0: the pixel is not looked at
  Image far_depth;   ///< [H,W,1] metres: nor farther
  std::vector<int> sources;  ///< views that it is compared with, best first (choose_sources)
};

struct StereoOptions {
  int sources = 3;  ///< views compared with each, 1 to 8; more is slower, and surer where cameras
                    ///< are many
  int levels = 2;   ///< resolutions, each half of the next; more for large smooth surfaces
  int iterations = 4;         ///< red and black sweeps on the coarsest level, 1 to 16
  int refinements = 3;        ///< sweeps on every level, 1 to 16, with the other views' depths
  double colour_sigma = 0.1;  ///< difference of values at which a pixel of the window counts less
  double level_weight = 0.3;  ///< cost of brightness that differs by a window's contrast between
                              ///< views; 0: only its pattern counts, exposures may differ
  double geometric_weight = 0.6;  ///< cost of one pixel of disagreement with another view's depth
  double prior_weight = 0.1;      ///< cost of a plane that is far from what sure pixels nearby
                                  ///< predict; more for cloth and skin without texture
  std::string vectors = "auto";   ///< CPU vector code: auto, scalar, avx2; the same bits
  std::int64_t seed = 1;          ///< of the random planes
};
OptionTable describe(StereoOptions& options);

/// A view's estimate of the surface after stereo.
struct DepthMap {
  Camera camera;     ///< of the view
  Image depth;       ///< [H,W,1] metres along the optical axis, 0: none
  Image normal;      ///< [H,W,3] unit, in the world, towards the camera
  Image confidence;  ///< [H,W,1] 0 to 1: one minus the cost of the plane
};

/// PatchMatch multi-view stereo of all views (one instant): checkerboard propagation of slanted
/// planes, weighted NCC over sources chosen for each pixel, coarse to fine, with agreement between
/// the views' depths (Galliani 2015; Schoenberger 2016; Xu and Tao 2019; the choice of parameters
/// is ours). Every pixel that is looked at gets a plane; what to trust is decided by `fuse`.
///
/// The same result on any number of threads. Throws LogicError for views whose sizes differ from
/// their images, cameras with distortion, or sources out of range; DataError for depth bounds that
/// are not finite or crossed; EnvironmentError without the device. Cost: pixels looked at x
/// (iterations/4^levels + refinements) x 13 planes x sources x 32 samples; memory: 40 bytes a pixel
/// of all views.
std::vector<DepthMap> stereo(const std::vector<StereoView>& views,
                             const StereoOptions& options = {}, Device device = Device::Cpu);

}  // namespace atelier
