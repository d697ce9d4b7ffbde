#include <algorithm>
#include <cmath>

#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/gltf_skeleton.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/io/scene_file.h"

namespace atelier {
namespace {

constexpr double kDefaultRate = 30;
constexpr double kMostRate = 1000;
constexpr double kUnsaidStretch = 0.01;  // metres a bone may move unsaid

Eigen::VectorXd key(const GltfChannel& channel, Index k) {
  return channel.values.row(channel.interpolation == GltfInterpolation::CubicSpline ? 3 * k + 1
                                                                                    : k);
}

// glTF 2.0, appendix C: Hermite spline with tangents scaled by the time between keys.
Eigen::VectorXd spline(const GltfChannel& channel, Index k, double s, double dt) {
  const Eigen::VectorXd a = channel.values.row(3 * k + 1);
  const Eigen::VectorXd out = dt * channel.values.row(3 * k + 2);
  const Eigen::VectorXd in = dt * channel.values.row(3 * k + 3);
  const Eigen::VectorXd b = channel.values.row(3 * k + 4);
  const double s2 = s * s;
  const double s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * a + (s3 - 2 * s2 + s) * out + (-2 * s3 + 3 * s2) * b +
         (s3 - s2) * in;
}

Eigen::VectorXd sampled(const GltfChannel& channel, double time) {
  const Index count = static_cast<Index>(channel.times.size());
  const auto after = std::upper_bound(channel.times.begin(), channel.times.end(), time);
  const Index k = std::clamp<Index>(after - channel.times.begin() - 1, 0, count - 1);
  Eigen::VectorXd value = key(channel, k);
  if (k + 1 < count && time > channel.times[static_cast<std::size_t>(k)]) {
    const double begin = channel.times[static_cast<std::size_t>(k)];
    const double dt = channel.times[static_cast<std::size_t>(k) + 1] - begin;
    const double s = (time - begin) / dt;
    if (channel.interpolation == GltfInterpolation::CubicSpline) {
      value = spline(channel, k, s, dt);
    } else if (channel.interpolation == GltfInterpolation::Linear) {
      Eigen::VectorXd next = key(channel, k + 1);
      if (channel.path == GltfPath::Rotation) {
        // Spherical, the short way: through the rotation between the two.
        const Eigen::Matrix3d from = matrix_of_quaternion(Eigen::Vector4d(value).normalized());
        const Eigen::Matrix3d to = matrix_of_quaternion(Eigen::Vector4d(next).normalized());
        return quaternion_of_matrix(from *
                                    rotation_matrix(s * rotation_vector(from.transpose() * to)));
      }
      value = (1 - s) * value + s * next;
    }
  }
  return value;
}

// The times of the keys where those of the channel with the most are even, else none.
std::vector<double> even_times(const GltfAnimation& animation) {
  const std::vector<double>* times = nullptr;
  for (const GltfChannel& channel : animation.channels) {
    if (times == nullptr || channel.times.size() > times->size()) {
      times = &channel.times;
    }
  }
  if (times == nullptr || times->size() < 3) {
    return {};
  }
  const double step = (times->back() - times->front()) / static_cast<double>(times->size() - 1);
  for (std::size_t i = 1; i < times->size(); ++i) {
    if (std::abs((*times)[i] - (*times)[i - 1] - step) > 0.02 * step) {
      return {};
    }
  }
  const double rate = frame_rate(step);
  return rate >= 1 && rate <= kMostRate ? *times : std::vector<double>{};
}

double rate_of_even(const std::vector<double>& times) {
  return frame_rate((times.back() - times.front()) / static_cast<double>(times.size() - 1));
}

}  // namespace

MotionClip read_gltf_motion(const GltfScene& scene, const std::string& file, std::size_t index,
                            const MotionOptions& options, const Limits& limits) {
  if (scene.skins.empty()) {
    throw DataError(file, "skins", "none", "a skeleton that the animation moves");
  }
  if (index >= scene.animations.size()) {
    const std::size_t count = scene.animations.size();
    throw DataError(file, "animations", count == 0 ? "none" : std::to_string(count),
                    index == 0 ? "a motion" : "animation " + std::to_string(index));
  }
  int skin = 0;
  for (const GltfNode& node : scene.nodes) {
    if (node.mesh >= 0 && node.skin >= 0) {
      skin = node.skin;
      break;
    }
  }
  const GltfSkeleton tree = gltf_skeleton(scene, skin, file);
  const GltfAnimation& animation = scene.animations[index];
  double first = 0;
  double last = 0;
  bool moves = false;
  for (const GltfChannel& channel : animation.channels) {
    if (channel.times.empty()) {
      continue;
    }
    first = moves ? std::min(first, channel.times.front()) : channel.times.front();
    last = moves ? std::max(last, channel.times.back()) : channel.times.back();
    moves =
        moves || std::find(tree.nodes.begin(), tree.nodes.end(), channel.node) != tree.nodes.end();
  }
  if (!moves) {
    throw DataError(file, "animation " + animation.name, "no channel that moves a joint",
                    "rotations of the skin's joints");
  }
  MotionClip clip;
  clip.name = animation.name.empty() ? file : animation.name;
  clip.skeleton = tree.skeleton;
  clip.findings = tree.findings;
  const std::vector<double> keys = even_times(animation);
  clip.motion.fps = options.fps > 0 ? options.fps
                    : keys.empty()  ? kDefaultRate
                                    : rate_of_even(keys);
  // Frames at the keys themselves where these span the animation; times are rounded to float in the
  // file, which must not cost the last frame.
  const bool at_keys =
      options.fps <= 0 && !keys.empty() && keys.front() == first && keys.back() == last;
  const double frames = at_keys ? static_cast<double>(keys.size())
                                : std::floor((last - first) * clip.motion.fps + 1e-2) + 1;
  if (!(frames >= 1 && frames <= static_cast<double>(limits.frames))) {
    throw DataError(file, "animation " + animation.name, std::to_string(last - first) + " seconds",
                    "at most " + std::to_string(limits.frames) + " frames");
  }
  const Index joints = static_cast<Index>(tree.nodes.size());
  double stretch = 0;
  GltfScene posed;
  posed.nodes = scene.nodes;
  posed.roots = scene.roots;
  for (int frame = 0; frame < static_cast<int>(frames); ++frame) {
    const double time =
        at_keys ? keys[static_cast<std::size_t>(frame)] : first + frame / clip.motion.fps;
    for (const GltfChannel& channel : animation.channels) {
      if (channel.times.empty() || channel.node < 0 || channel.path == GltfPath::Weights) {
        continue;
      }
      GltfNode& node = posed.nodes[static_cast<std::size_t>(channel.node)];
      node.matrix.reset();
      node.mesh = node.skin = -1;
      const Eigen::VectorXd value = sampled(channel, time);
      if (channel.path == GltfPath::Translation) {
        node.translation = value;
      } else if (channel.path == GltfPath::Rotation) {
        node.rotation = Eigen::Vector4d(value).normalized();
      } else {
        node.scale = value;
      }
    }
    for (GltfNode& node : posed.nodes) {
      node.mesh = node.skin = -1;
      node.weights.clear();
    }
    const std::vector<Eigen::Matrix4d> world = world_from_nodes(posed);
    Pose pose;
    pose.rotations.resize(joints, 3);
    std::vector<Eigen::Matrix3d> rotations(static_cast<std::size_t>(joints));
    for (Index j = 0; j < joints; ++j) {
      const std::size_t row = static_cast<std::size_t>(j);
      const Eigen::Matrix4d& frame_of_joint = world[static_cast<std::size_t>(tree.nodes[row])];
      // Columns made unit: the scales of the scene are in the skeleton already.
      Eigen::Matrix3d axes = frame_of_joint.topLeftCorner<3, 3>();
      axes.colwise().normalize();
      if (!axes.allFinite()) {
        throw DataError(file, "animation " + animation.name, "a joint scaled to nothing",
                        "scales other than 0");
      }
      rotations[row] = matrix_of_quaternion(quaternion_of_matrix(axes));
      const int parent = clip.skeleton.parents[row];
      const Eigen::Matrix3d above = parent < 0 ? Eigen::Matrix3d::Identity().eval()
                                               : rotations[static_cast<std::size_t>(parent)];
      const Eigen::Matrix3d before = above * rotation_matrix(clip.skeleton.rest_rotations.row(j));
      pose.rotations.row(j) = rotation_vector(before.transpose() * rotations[row]);
      const Eigen::Vector3d position = frame_of_joint.topRightCorner<3, 1>();
      if (parent < 0) {
        pose.root_translation = position - clip.skeleton.offsets.row(0).transpose();
      } else {
        const Eigen::Vector3d parent_position =
            world[static_cast<std::size_t>(tree.nodes[static_cast<std::size_t>(parent)])]
                .topRightCorner<3, 1>();
        stretch = std::max(stretch, std::abs((position - parent_position).norm() -
                                             clip.skeleton.offsets.row(j).norm()));
      }
    }
    clip.motion.poses.push_back(std::move(pose));
    clip.motion.frame_ids.push_back(frame);
  }
  if (stretch > kUnsaidStretch) {
    clip.findings.push_back(
        {Severity::Warning, "motion-stretch", file,
         "bones change their length, by up to " + std::to_string(stretch) + " m",
         "the bones keep the length of the bind pose"});
  }
  check_motion_clip(clip, file);
  return clip;
}

MotionClip read_gltf_motion(const std::filesystem::path& path, const MotionOptions& options,
                            const Limits& limits) {
  MotionClip clip = read_gltf_motion(read_scene(path, limits), path.string(), 0, options, limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
