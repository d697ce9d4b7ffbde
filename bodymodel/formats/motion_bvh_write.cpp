#include <cmath>
#include <numbers>

#include "bodymodel/euler.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/portable_names.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/missing_frames.h"
#include "bodymodel/rotation.h"
#include "core/atomic_file.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kShortestTip = 1e-3;  // m, below which a bone is none
constexpr double kTip = 0.05;          // m, of a joint without any bone

std::string decimal(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.6f", value);
  return text;
}

std::string triple(const Eigen::Vector3d& v) {
  return decimal(v.x()) + " " + decimal(v.y()) + " " + decimal(v.z());
}

// The joints in the order in which BVH nests them.
void visit(const Skeleton& skeleton, int joint, std::vector<int>& order) {
  order.push_back(joint);
  for (std::size_t child = 0; child < skeleton.parents.size(); ++child) {
    if (skeleton.parents[child] == joint) {
      visit(skeleton, static_cast<int>(child), order);
    }
  }
}

class Writer {
 public:
  Writer(const MotionClip& clip, const BvhWriteOptions& options)
      : clip_(clip),
        options_(options),
        names_(portable_names(clip.skeleton.names)),
        rest_(forward_kinematics(clip.skeleton, rest_pose(clip.skeleton))) {}

  std::string text() {
    text_ = "HIERARCHY\n";
    joint(0, 0);
    motion();
    return text_;
  }

 private:
  // From its parent. The root's is 0: its position channels say where it is, and programs do not
  // agree on whether these replace its OFFSET or add to it.
  Eigen::Vector3d offset(int j) const {
    const int parent = clip_.skeleton.parents[static_cast<std::size_t>(j)];
    if (parent < 0) {
      return Eigen::Vector3d::Zero();
    }
    return (rest_.positions.row(j) - rest_.positions.row(parent)).transpose() /
           options_.metres_per_unit;
  }

  // Where a leaf's bone ends. Where nobody says: a third of the bone before it, straight on, since
  // Blender makes bones of 1 mm of end sites without a length. Our choice.
  Eigen::Vector3d tip(int j) const {
    for (const EndSite& site : clip_.end_sites) {
      if (site.joint == j && site.offset.norm() > kShortestTip) {
        return rest_.rotations[static_cast<std::size_t>(j)] * site.offset /
               options_.metres_per_unit;
      }
    }
    const Eigen::Vector3d bone = offset(j) * options_.metres_per_unit / 3;
    return (bone.norm() > kShortestTip ? bone : Eigen::Vector3d(0, kTip, 0)) /
           options_.metres_per_unit;
  }

  void joint(int j, int depth) {
    const std::string tabs(static_cast<std::size_t>(depth), '\t');
    text_ += tabs + (depth == 0 ? "ROOT " : "JOINT ") + names_[static_cast<std::size_t>(j)] + "\n" +
             tabs + "{\n" + tabs + "\tOFFSET " + triple(offset(j)) + "\n" + tabs + "\tCHANNELS " +
             (depth == 0 ? "6 Xposition Yposition Zposition" : "3");
    for (const char axis : options_.order) {
      text_ += std::string(" ") + axis + "rotation";
    }
    text_ += "\n";
    bool leaf = true;
    for (std::size_t child = 0; child < clip_.skeleton.parents.size(); ++child) {
      if (clip_.skeleton.parents[child] == j) {
        joint(static_cast<int>(child), depth + 1);
        leaf = false;
      }
    }
    if (leaf) {
      text_ += tabs + "\tEnd Site\n" + tabs + "\t{\n" + tabs + "\t\tOFFSET " + triple(tip(j)) +
               "\n" + tabs + "\t}\n";
    }
    text_ += tabs + "}\n";
  }

  void motion() {
    std::vector<int> order;
    visit(clip_.skeleton, 0, order);
    text_ += "MOTION\nFrames: " + std::to_string(clip_.motion.poses.size()) + "\nFrame Time: ";
    char seconds[40];
    std::snprintf(seconds, sizeof(seconds), "%.8f", 1 / clip_.motion.fps);
    text_ += std::string(seconds) + "\n";
    Points before = Points::Zero(static_cast<Index>(order.size()), 3);
    for (const Pose& pose : clip_.motion.poses) {
      const JointFrames frames = forward_kinematics(clip_.skeleton, pose);
      text_ += triple(frames.positions.row(0).transpose() / options_.metres_per_unit);
      for (const int j : order) {
        // The joint's turn away from rest in world axes, relative to its parent's.
        const std::size_t index = static_cast<std::size_t>(j);
        const int parent = clip_.skeleton.parents[index];
        Eigen::Matrix3d turn = frames.rotations[index] * rest_.rotations[index].transpose();
        if (parent >= 0) {
          const std::size_t p = static_cast<std::size_t>(parent);
          turn = (frames.rotations[p] * rest_.rotations[p].transpose()).transpose() * turn;
        }
        const Eigen::Vector3d angles = euler_angles(options_.order, turn, before.row(j));
        before.row(j) = angles;
        text_ += " " + triple(kDegrees * angles);
      }
      text_ += "\n";
    }
  }

  const MotionClip& clip_;
  const BvhWriteOptions& options_;
  const std::vector<std::string> names_;
  const JointFrames rest_;
  std::string text_;
};

}  // namespace

std::string bvh_text(const MotionClip& clip, const BvhWriteOptions& options) {
  check_motion_clip(clip);
  ATELIER_CHECK(options.metres_per_unit > 0, "metres per unit is positive");
  euler_angles(options.order, Eigen::Matrix3d::Identity());  // refuses an unknown order
  MotionClip whole = clip;
  whole.motion = without_gaps(clip.motion);
  return Writer(whole, options).text();
}

void write_bvh(const std::filesystem::path& path, const MotionClip& clip,
               const BvhWriteOptions& options) {
  write_file_atomically(path, bvh_text(clip, options));
}

}  // namespace atelier
