#include "bodymodel/formats/motion_amc.h"

#include <cctype>
#include <map>
#include <numbers>

#include "bodymodel/euler.h"
#include "bodymodel/formats/asf_skeleton.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"

namespace atelier {
namespace {

constexpr double kCmuRate = 120;

// A skeleton whose joints are where bones begin: joint of bone b is the end of its parent.
void set_skeleton(const AsfSkeleton& asf, MotionClip& clip) {
  const Index count = static_cast<Index>(asf.bones.size());
  clip.skeleton.offsets = Points::Zero(count, 3);
  std::vector<bool> leaf(asf.bones.size(), true);
  for (std::size_t b = 0; b < asf.bones.size(); ++b) {
    const AsfBone& bone = asf.bones[b];
    clip.skeleton.names.push_back(bone.name);
    clip.skeleton.parents.push_back(bone.parent);
    if (bone.parent > 0) {
      const AsfBone& parent = asf.bones[static_cast<std::size_t>(bone.parent)];
      clip.skeleton.offsets.row(static_cast<Index>(b)) = parent.length * parent.direction;
    }
    if (bone.parent >= 0) {
      leaf[static_cast<std::size_t>(bone.parent)] = false;
    }
  }
  clip.skeleton.offsets.row(0) = asf.bones[0].length * asf.bones[0].direction;
  for (std::size_t b = 1; b < asf.bones.size(); ++b) {
    if (leaf[b]) {
      clip.end_sites.push_back({static_cast<int>(b), asf.bones[b].length * asf.bones[b].direction});
    }
  }
}

class AmcReader {
 public:
  AmcReader(const AsfSkeleton& asf, std::span<const std::byte> bytes, const std::string& name,
            const Limits& limits)
      : asf_(asf), scanner_(as_text(bytes), name, limits.line_bytes), limits_(limits) {
    for (std::size_t b = 0; b < asf.bones.size(); ++b) {
      names_[asf.bones[b].name] = b;
    }
  }

  Motion read() {
    double radians = std::numbers::pi / 180;
    Pose pose;
    std::vector<bool> seen;
    std::int64_t frame = -1;
    const auto finish = [&] {
      for (std::size_t b = 0; b < seen.size() && frame >= 0; ++b) {
        if (!seen[b] && !asf_.bones[b].dofs.empty()) {
          scanner_.fail(
              "no bone " + in_quotes(asf_.bones[b].name) + " in frame " + std::to_string(frame),
              "every bone with degrees of freedom in every frame");
        }
      }
      if (frame >= 0) {
        motion_.poses.push_back(pose);
        motion_.frame_ids.push_back(static_cast<int>(frame));
      }
    };
    while (scanner_.next_line()) {
      const std::string word(scanner_.next_word());
      if (word.empty()) {
        continue;
      }
      if (word[0] == ':') {
        radians = word == ":RADIANS" || word == ":radians" ? 1 : radians;
        continue;
      }
      std::int64_t number = 0;
      if (parse_integer(word, number)) {
        finish();
        if (number <= frame || number > limits_.frames ||
            static_cast<std::int64_t>(motion_.poses.size()) >= limits_.frames) {
          scanner_.fail("frame " + in_quotes(word),
                        "increasing frame numbers up to " + std::to_string(limits_.frames));
        }
        frame = number;
        pose.root_translation.setZero();
        pose.rotations = Points::Zero(static_cast<Index>(asf_.bones.size()), 3);
        seen.assign(asf_.bones.size(), false);
        continue;
      }
      if (frame < 0) {
        scanner_.fail(in_quotes(word), "a frame number before the first bone");
      }
      const auto found = names_.find(word);
      if (found == names_.end()) {
        scanner_.fail("bone " + in_quotes(word), "a bone of the ASF skeleton");
      }
      if (seen[found->second]) {
        scanner_.fail("bone " + in_quotes(word) + " twice in frame " + std::to_string(frame),
                      "each bone once");
      }
      seen[found->second] = true;
      read_bone(found->second, radians, pose);
    }
    finish();
    if (motion_.poses.empty()) {
      scanner_.fail("no frames", "at least one");
    }
    return std::move(motion_);
  }

 private:
  void read_bone(std::size_t b, double radians, Pose& pose) {
    const AsfBone& bone = asf_.bones[b];
    Eigen::Vector3d angles = Eigen::Vector3d::Zero();  // about x, y, z
    for (const char dof : bone.dofs) {
      const double value = scanner_.number("a degree of freedom");
      if (dof >= 'x') {
        pose.root_translation[dof - 'x'] = value;
      } else {
        angles[dof - 'X'] = radians * value;
      }
    }
    if (!scanner_.next_word().empty()) {
      scanner_.fail("more values of bone " + in_quotes(bone.name),
                    std::to_string(bone.dofs.size()) + ", one for each degree of freedom");
    }
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    for (const char axis : bone.order) {
      turn = axis_rotation(axis - 'X', angles[axis - 'X']) * turn;
    }
    pose.rotations.row(static_cast<Index>(b)) =
        rotation_vector(bone.axis * turn * bone.axis.transpose());
  }

  const AsfSkeleton& asf_;
  TextScanner scanner_;
  const Limits& limits_;
  std::map<std::string, std::size_t> names_;
  Motion motion_;
};

}  // namespace

MotionClip read_amc(std::span<const std::byte> asf, const std::string& asf_name,
                    std::span<const std::byte> amc, const std::string& amc_name,
                    const MotionOptions& options, const Limits& limits) {
  const AsfSkeleton tree = read_asf(asf, asf_name, limits);
  MotionClip clip;
  clip.name = amc_name;
  set_skeleton(tree, clip);
  clip.motion = AmcReader(tree, amc, amc_name, limits).read();
  clip.motion.fps = kCmuRate;
  if (options.fps == 0) {
    clip.findings.push_back({Severity::Note, "motion-fps", amc_name,
                             "the file has no frame rate; 120 per second is taken, as CMU records",
                             "--motion.fps sets another"});
  }
  clip = in_metres_y_up(std::move(clip), options);
  check_motion_clip(clip, amc_name);
  return clip;
}

MotionClip read_amc(const std::filesystem::path& asf, const std::filesystem::path& amc,
                    const MotionOptions& options, const Limits& limits) {
  MotionClip clip =
      read_amc(read_file_bytes(asf, limits.motion_file_bytes), asf.string(),
               read_file_bytes(amc, limits.motion_file_bytes), amc.string(), options, limits);
  clip.name = amc.stem().string();
  return clip;
}

}  // namespace atelier
