#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "appearance/appearance_colors.h"
#include "core/measure.h"
#include "pipeline/outfit/worn_subject.h"
#include "pipeline/synthesis/simulated_motion.h"
#include "registration/tracking/registration_error.h"

namespace atelier {

// How images by networks are judged, without the networks, results and files: what
// measure_appearance puts together.

/// How far one kind of image is from the true ones: sums over pixels and their three channels of
/// numbers in [0,1].
struct PictureDifference {
  double squares = 0;
  double count = 0;
  double shadow_squares = 0;  ///< of the quarter that sees least of the sky
  double shadow_count = 0;
  double similarity = 0;         ///< structural, times pixels
  double shadow_similarity = 0;  ///< the same of the quarter
};

/// Sums of all garments of one result.
struct ComparedPictures {
  PictureDifference drawn, fixed;  ///< by the network, and by the texture that does not change
  double judged = 0;               ///< pixels of the ground-truth garments
  double covered = 0;              ///< of them, those that the model draws
};

ComparedPictures& operator+=(ComparedPictures& sum, const ComparedPictures& more);

/// What a camera sees in a frame, [H,W,3] as 8-bit sRGB holds it, in [0,1].
using TruePicture = std::function<Image(std::size_t camera_idx, int frame_id)>;

/// Frames that are judged: of a capture, or simulated.
struct JudgedScenes {
  WornSubject truth;  ///< the ground-truth surfaces in them
  WornSubject own;    ///< what a result has instead
  std::vector<int> frame_ids;
  TruePicture picture;
};

/// What is drawn of one garment, and where the ground truth has it.
struct DrawnSurfaces {
  AppearanceData truth;     ///< pixels to be judged: eroded, of the true garment
  AppearanceData own;       ///< pixels that the model's geometry covers
  AppearanceColors colors;  ///< of those
};

/// What is to be judged and what a network is to be asked for, of one surface: `colors` are still
/// to come, one for each pixel of `own`.
/// @param own, in_truth  the surface, of the scenes' `own` and `truth`
/// @param atlas          of the network
/// @param occlusion      as it learnt
DrawnSurfaces asked_of(const JudgedScenes& scenes, std::size_t own, std::size_t in_truth,
                       const std::vector<Camera>& cameras, const PackedAtlas& atlas,
                       const OcclusionOptions& occlusion);

/// Each camera's gain over the geometric mean of those that were trained with, [C] of three: what a
/// texture without gain is to be multiplied with.
std::vector<Eigen::Vector3d> gains_of(const std::vector<Camera>& wanted,
                                      const std::vector<Camera>& all,
                                      const std::vector<std::string>& trained);

/// Adds how far what is drawn of one surface is from the images, as 8-bit sRGB holds both.
/// @param gains  [C] of the cameras
void compare_pictures(ComparedPictures& sum, const DrawnSurfaces& surface,
                      const std::vector<Eigen::Vector3d>& gains, const TruePicture& picture);

/// Which garment of the ground truth one of a workspace is; as many surfaces as there are if none.
std::size_t same_garment(const WornSubject& in_truth, int label);

/// A template that rides on a true garment: of a workspace's surface, on one of the ground truth's.
struct TemplateRider {
  std::size_t own = 0;
  std::size_t garment = 0;
  TrueBinding binding;
};

/// Frames of a simulated motion. Templates ride on the ground-truth garments' triangles, each
/// vertex on the material point that it was nearest to in the template's frame: the network is
/// judged, not a simulation of the template. The motion has to outlive them.
/// @param worn  what has the templates; null: the ground-truth garments themselves are drawn
JudgedScenes simulated_scenes(const SimulatedMotion& motion, const GroundTruth& truth,
                              const WornSubject& in_truth, const WornSubject* worn,
                              const std::vector<TemplateRider>& riders);

struct JudgedGarment {
  std::string name;
  bool printed = false;  ///< its cloth has a print, which has a target of its own
  ComparedPictures compared;
};

/// One result of `appearance` or `oracle`.
struct JudgedNetworks {
  std::vector<JudgedGarment> garments;
  ComparedPictures body;       ///< where it is in front, if it has a network
  ComparedPictures simulated;  ///< garments in a motion that the capture does not show
  std::string setting;
  int resolution = 0;
  int iterations = 0;
};

/// <stage>.* of a result: of all its garments together and, of several, <stage>.<garment>_psnr_db
/// of each. Together they have the target of printed cloth where all of them are.
/// @param motion  the name of the simulated one; ""
std::vector<Measure> measures_of(const std::string& stage, const JudgedNetworks& judged,
                                 const std::string& motion);

}  // namespace atelier
