#pragma once

#include <filesystem>

#include "bodymodel/body_model.h"
#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

struct MotionFileOptions {
  MotionOptions motion;
  std::filesystem::path asf;  ///< skeleton of an .amc; "": the .asf beside it that its name begins
                              ///< with ("11_01.amc": "11.asf") or that is alone
  MarkerFitOptions markers;   ///< of .trc and .c3d
  const BodyModel* body =
      nullptr;            ///< the body that will be moved: of SMPL's family, AMASS is exact
  Eigen::VectorXd shape;  ///< of that body; empty: neutral
};

/// For a motion of `body` in its neutral shape.
inline MotionFileOptions of_body(const BodyModel& body) {
  MotionFileOptions options;
  options.body = &body;
  return options;
}

/// Reads a motion of any format, told by extension and content: .bvh; .npz of ours or of AMASS;
/// .glb, .gltf and .fbx; .trc and .c3d, by fitting a person to their markers (marker_fit.h); .amc.
/// Frame rates that no person is recorded at are findings or refused (odd_frame_rate), unless
/// `options` set another; leaps and bones of no person are findings (check_motion). Frames whose
/// numbers are missing are filled (missing_frames.h), but of npz, which names frames of a capture.
/// Throws
/// DataError for another extension, an .amc whose skeleton is not found, and what is beyond a stage
/// (check_on_stage).
///
/// npz and glTF say their unit and axes; `options` still change them where they are set, and legs
/// that no person has (0.15 to 1.5 m) are taken for another unit, with a finding ("motion-unit").
MotionClip read_motion_file(const std::filesystem::path& path,
                            const MotionFileOptions& options = {}, const Limits& limits = {});

/// Writes .bvh, .trc (places of the joints), .npz (ours), .glb or .gltf (skeleton and animation).
/// Throws LogicError for another extension.
void write_motion_file(const std::filesystem::path& path, const MotionClip& clip);

}  // namespace atelier
