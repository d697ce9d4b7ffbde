#pragma once

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/tracking/track.h"

namespace atelier {

struct PersonalizeOptions {
  /// A person differs from every shape of the model by more than the noise of scans, with errors
  /// that are correlated over whole limbs: a scan counts as few independent points, so that
  /// keypoints determine the joints.
  FrameWeights weights = {.keypoint = 0.008, .surface_points = 10};
  int samples = 3000;            ///< points of each scan in an iteration, [0, 1e7]; 0: all
  double bone_lengths = 0.015;   ///< standard deviation of a bone's length relative to that of the
                                 ///< model's shape, [0, 1]; 0: the shape alone
  int shape_rounds = 6;          ///< of ICP while the shape is estimated, [1, 100]
  int surface_rounds = 4;        ///< of ICP while the surface is displaced, [0, 100]
  double surface_noise = 0.003;  ///< m, of a scan, [1e-5, 0.1]; larger smooths more
  double smoothness = 0.01;  ///< m over which displacements are smoothed where scans are as noisy
                             ///< as `surface_noise`, [1e-3, 1]
  double displacement = 0.015;  ///< m, standard deviation off the shape space, [1e-4, 0.2]
};
OptionTable describe(PersonalizeOptions& options);

struct Personalization {
  PersonalBody person;
  std::vector<Eigen::VectorXd> poses;  ///< [F] variables of the frames, see pose_variables
  double scan_rms = 0;      ///< m, between scans and the person's surface; 0: no skin was seen
  double keypoint_rms = 0;  ///< m
  double unseen = 0;        ///< share of the surface without correspondences
  std::vector<Finding> findings;  ///< "frames-few", "surface-unseen", "no-scans",
                                  ///< "scan-far", "measure-implausible", and track's
};

/// Fits a person to frames (Zhang et al. 2017, our choice of terms):
///  - poses from keypoints at the neutral shape (start_pose.h);
///  - shape values and bone lengths (bone_lengths.h), shared by all frames, and poses together:
///    least squares by Ceres over keypoints and points of the scans (frame_energy.h) with a prior
///    towards the mean shape, with new correspondences in every round;
///  - one field of displacements along the normals of the rest surface, on the union of all unposed
///    scans: residuals of the vertices, averaged over the frames that see them, smoothed by a
///    Laplacian, and mirrored where only the other side of the body was seen; alternating with the
///    poses.
/// Three frames are enough; with fewer it warns. Only skin moves the surface: where a person was
/// seen in loose clothing alone, the shape comes from skin and keypoints. Without scans the shape
/// comes from keypoints alone, with the noise that a first fit finds: they determine lengths, and
/// a prior determines girths from the stature (thickness.h). Works with every model of a
/// person; one without shape parameters gets a size, bone lengths and the displacements. Throws as
/// `track` does. O(frames x rounds x samples).
Personalization personalize(const BodyModel& model, const TrackInput& input,
                            const PersonalizeOptions& options = {});

/// The vertex on the other side of the body for every vertex: the nearest to its mirror image in x,
/// -1 if none is within 1 cm. [V]
std::vector<int> mirror_vertices(const Points& rest);

}  // namespace atelier
