#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

/// Reads Biovision BVH. Channels in any order and number (rotation orders of one to three axes,
/// joints with and without positions mixed): a joint's rotation is the product of its rotation
/// channels in the order of the file. Words in any case, names with blanks, tabs, CRLF, CR.
///
/// Positions of the root replace its OFFSET (as Blender reads them), unless they are zero in every
/// frame. Positions of another joint are places in its parent or changes of its OFFSET, whichever
/// the first frame is nearer to. A skeleton has fixed bones: places that stay, and those of a joint
/// whose OFFSET is zero, are its bone (their mean); what else moves a bone is dropped with a
/// finding
/// ("motion-stretch") if it is more than 1% of the height. The joint that both legs hang on goes
/// where its own positions and those of the joints above it take it (path_joint.h). Repeated names
/// get a number, with a finding ("motion-names").
///
/// Throws DataError, with the line, for: anything out of place, no or two roots, a channel unknown
/// or repeated, fewer or more values in a frame than channels, fewer or more frames than stated, a
/// frame time that is not positive, numbers that are not finite, lengths beyond
/// `limits.mesh_coordinate`, more joints or frames than `limits`, several joints without any bone.
MotionClip read_bvh(std::span<const std::byte> bytes, const std::string& name,
                    const MotionOptions& options = {}, const Limits& limits = {});
MotionClip read_bvh(const std::filesystem::path& path, const MotionOptions& options = {},
                    const Limits& limits = {});

struct BvhWriteOptions {
  double metres_per_unit = 0.01;  ///< centimetres, as most programs expect
  std::string order = "ZXY";      ///< rotation channels, any of the six orders
};

/// BVH text: the root with six channels and OFFSET 0 (readers add it to the positions or do not),
/// other joints with three, Y up. Rest rotations are written into the poses, since BVH has none:
/// offsets become world-axes offsets and the motion is the same. Characters of joint names other
/// than ASCII letters, digits, '_', '-' and '.' become '_'; every end site has a length. Frames
/// that are missing are filled (missing_frames.h), since BVH has no frame numbers. Throws DataError
/// if the clip is not valid, LogicError for an unknown order.
std::string bvh_text(const MotionClip& clip, const BvhWriteOptions& options = {});
void write_bvh(const std::filesystem::path& path, const MotionClip& clip,
               const BvhWriteOptions& options = {});

}  // namespace atelier
