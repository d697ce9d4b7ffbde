#include "bodymodel/formats/motion_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <utility>

#include "bodymodel/check_motion.h"
#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/motion_amass.h"
#include "bodymodel/formats/motion_amc.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_c3d.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/formats/path_joint.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/missing_frames.h"
#include "bodymodel/odd_frame_rate.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/io/scene_file.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr double kMinLegs = 0.15;  // metres, hip to knee to ankle
constexpr double kMaxLegs = 1.5;

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return extension;
}

std::filesystem::path skeleton_of(const std::filesystem::path& amc) {
  std::vector<std::filesystem::path> all;
  std::filesystem::path best;
  const std::string stem = amc.stem().string();
  const std::filesystem::path folder = amc.has_parent_path() ? amc.parent_path() : ".";
  if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (extension_of(entry.path()) == ".asf") {
        all.push_back(entry.path());
        const std::string name = entry.path().stem().string();
        if (stem.starts_with(name) && name.size() > best.stem().string().size()) {
          best = entry.path();
        }
      }
    }
  }
  if (best.empty() && all.size() == 1) {
    best = all[0];
  }
  if (best.empty()) {
    throw DataError(amc.string(), "skeleton", "no .asf of that name beside it",
                    "the ASF file of this motion");
  }
  return best;
}

// A clip of a format that is in metres, Y up, with what `options` say instead.
MotionClip as_said(MotionClip clip, MotionOptions options) {
  const std::optional<Humanoid> person = find_humanoid(clip.skeleton);
  const double legs = person ? leg_length(clip.skeleton, *person) : 1;
  if (options.metres_per_unit == 0 && legs > kMinLegs && legs < kMaxLegs) {
    options.metres_per_unit = 1;
  }
  options.up = options.up == 0 ? 'y' : options.up;
  return in_metres_y_up(std::move(clip), options);
}

MotionClip read_npz_motion(const std::filesystem::path& path, const MotionFileOptions& options,
                           const Limits& limits) {
  const Npz npz(path, limits);
  if (!archive_schema(npz).empty()) {
    return as_said(motion_of_arrays(npz, limits), options.motion);
  }
  const BodyModel* body = options.body;
  const bool neutral = body != nullptr && options.shape.size() == 0;
  MotionOptions turned = options.motion;
  turned.up = 'y';             // by then
  turned.metres_per_unit = 0;  // the path is, and bones are the body's
  return as_said(read_amass(path, body, neutral ? neutral_shape(*body) : options.shape,
                            options.motion, limits),
                 turned);
}

bool holds_one_motion(const std::string& extension) {
  constexpr std::array kFormats = {".bvh", ".amc", ".trc", ".c3d", ".npz"};
  return std::find(kFormats.begin(), kFormats.end(), extension) != kFormats.end();
}

/// Refuses another animation or skin than those that a format without any has: its motion, number
/// 1.
void require_only_motion(const std::filesystem::path& path, const MotionOptions& options) {
  for (const auto& [option, wanted] :
       {std::pair{"animation", options.animation}, std::pair{"skin", options.skin}}) {
    if (!wanted.empty() && wanted != "1") {
      throw UnknownValue(path.string(), option, wanted,
                         "1: a file of " + extension_of(path) + " holds one motion");
    }
  }
}

/// The person's path times `scale`: of the joint that both legs hang on, by the root.
void scale_path(MotionClip& clip, double scale) {
  const int path = path_joint(clip.skeleton);
  for (Pose& pose : clip.motion.poses) {
    const Eigen::Vector3d place = forward_kinematics(clip.skeleton, pose).positions.row(path);
    pose.root_translation += (scale - 1) * place;
  }
}

MotionClip read_by_extension(const std::filesystem::path& path, const MotionFileOptions& options,
                             const Limits& limits) {
  const std::string extension = extension_of(path);
  if (holds_one_motion(extension)) {
    require_only_motion(path, options.motion);
  }
  if (extension == ".bvh") {
    return read_bvh(path, options.motion, limits);
  }
  if (extension == ".amc") {
    return read_amc(options.asf.empty() ? skeleton_of(path) : options.asf, path, options.motion,
                    limits);
  }
  if (has_scene_extension(path)) {
    MotionOptions sampled = options.motion;
    sampled.fps = 0;
    return as_said(read_gltf_motion(path, options.motion, limits), sampled);
  }
  if (extension == ".trc" || extension == ".c3d") {
    return fit_markers(extension == ".trc" ? read_trc(path, limits) : read_c3d(path, limits),
                       options.motion, options.markers)
        .clip;
  }
  if (extension == ".npz") {
    return read_npz_motion(path, options, limits);
  }
  const std::string expected = "a motion: .bvh, .amc, .trc, .c3d, .npz, .glb, .gltf or .fbx";
  if (extension.empty()) {
    throw UnknownValue("", "motion", path.string(), expected);
  }
  throw DataError(path.string(), "file name", "extension '" + extension.substr(0, 20) + "'",
                  expected);
}

}  // namespace

MotionClip read_motion_file(const std::filesystem::path& path, const MotionFileOptions& options,
                            const Limits& limits) {
  MotionClip clip = read_by_extension(path, options, limits);
  const bool sampled = has_scene_extension(path);  // at a rate of the reader's or of `options`
  const RateStated stated = extension_of(path) == ".bvh" ? RateStated::Time : RateStated::Rate;
  const std::optional<Finding> odd = options.motion.fps > 0 || sampled
                                         ? std::nullopt
                                         : odd_frame_rate(clip.motion.fps, stated, path.string());
  if (odd) {
    clip.findings.push_back(*odd);
  }
  if (extension_of(path) != ".npz") {  // frame ids of ours are those of a capture
    fill_missing_frames(clip, path.string());
    clip.motion.fps = options.motion.fps > 0 && !sampled ? options.motion.fps : clip.motion.fps;
  }
  if (options.motion.path_scale != 1) {
    scale_path(clip, options.motion.path_scale);
  }
  check_on_stage(clip, path.string());
  const std::vector<Finding> doubts = check_motion(clip);
  clip.findings.insert(clip.findings.end(), doubts.begin(), doubts.end());
  return clip;
}

void write_motion_file(const std::filesystem::path& path, const MotionClip& clip) {
  const std::string extension = extension_of(path);
  if (extension == ".bvh") {
    write_bvh(path, clip);
  } else if (extension == ".npz") {
    write_motion(path, clip);
  } else if (extension == ".trc") {
    write_trc(path, joint_markers(clip));
  } else {
    ATELIER_CHECK(extension == ".glb" || extension == ".gltf",
                  "motions are written as .bvh, .trc, .npz, .glb or .gltf");
    write_gltf(path, gltf_motion(clip));
  }
}

}  // namespace atelier
