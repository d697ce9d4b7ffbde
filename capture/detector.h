#pragma once

#include <vector>

#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/options.h"
#include "core/random.h"
#include "core/types.h"

namespace atelier {

/// How a keypoint detector errs. Pixels are those of an image 1000 rows high; others scale.
struct DetectorOptions {
  bool perfect = false;    ///< the exact projections, confidence 1, of what is in the image
  double noise = 3;        ///< px, standard deviation of a seen point, [0, 100]
  double dropout = 0.02;   ///< share of seen points that are missed, [0, 1]
  double swaps = 0.01;     ///< share of images in which left and right legs or arms are swapped
  double outliers = 0.10;  ///< share of points that are somewhere else, [0, 1]
  double occluded_factor = 1.8;  ///< on noise where the point's body part is not seen, [1, 10]
  double cloth_factor = 3;       ///< on noise of points under cloth, [1, 10]
  double cloth_bias = 0.35;      ///< share of the way to the cloth's centre line, [0, 1]
};
OptionTable describe(DetectorOptions& options);

/// Observations of one point by the detector.
struct KeypointSight {
  bool seen = true;        ///< the body part is not hidden by another
  double under_cloth = 0;  ///< 0: bare; 1: under cloth that hangs 10 cm off or more
  bool covered = false;    ///< by a garment, tight or loose
  double centre_x = 0;     ///< px, middle of the cloth in the point's row; used where covered
};

/// Detections of one person: each true point (world, metres) projected, then displaced, missed,
/// swapped or misplaced. Every point draws its own blur (log-normal, sigma 0.5) that scales its
/// noise; its confidence falls with that blur, so that confident points are better. Outliers land
/// on a wrong limb or anywhere near the person; four of five have a low confidence. Throws
/// LogicError if sizes disagree.
Keypoints2d detected_keypoints(const Camera& camera, const KeypointSchema& schema,
                               const Points& points, const std::vector<KeypointSight>& sights,
                               const DetectorOptions& options, Random random);

/// OpenPose's JSON of one image: `people` with `pose_keypoints_2d`; for 133 points the same key
/// holds all of them. Three decimals.
std::string keypoints_json(const Keypoints2d& keypoints);

/// How a human-parsing network errs: pixels as in DetectorOptions.
struct LabelNoiseOptions {
  bool perfect = false;
  double wander = 2.5;      ///< px, how far borders stray smoothly, [0, 100]
  double erosion = 1;       ///< px, the person shrinks by this much where borders stray, [0, 50]
  double patches = 5;       ///< wrong patches along borders of an image, mean, [0, 1000]
  double patch_radius = 9;  ///< px, of the largest, [0, 500]
};
OptionTable describe(LabelNoiseOptions& options);

/// Labels as a network gives them.
ByteImage detected_labels(const ByteImage& truth, const LabelNoiseOptions& options, Random random);

}  // namespace atelier
