#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/gltf_people.h"
#include "bodymodel/formats/gltf_skeleton.h"
#include "bodymodel/formats/path_joint.h"
#include "bodymodel/odd_frame_rate.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/io/scene_file.h"
#include "core/io/text_scanner.h"
#include "core/nearest_name.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr double kDefaultRate = 30;
constexpr double kMaxRate = 1000;
constexpr std::size_t kManyKeys = 8;     // evenly apart they are frames, and no animator's
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
std::vector<double> even_keys(const GltfAnimation& animation) {
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
  if (!(step > 0)) {
    return {};
  }
  for (std::size_t i = 1; i < times->size(); ++i) {
    if (std::abs((*times)[i] - (*times)[i - 1] - step) > 0.02 * step) {
      return {};
    }
  }
  return *times;
}

double rate_of_even(const std::vector<double>& times) {
  return frame_rate((times.back() - times.front()) / static_cast<double>(times.size() - 1));
}

// From the first key to the last of all channels.
struct GltfTimeSpan {
  double first = 0, last = 0;  // s
};

// Throws DataError where no channel moves a joint.
GltfTimeSpan time_span(const GltfAnimation& animation, const GltfSkeleton& tree,
                       const std::string& file) {
  GltfTimeSpan span;
  bool moves = false;
  for (const GltfChannel& channel : animation.channels) {
    if (channel.times.empty()) {
      continue;
    }
    span.first = moves ? std::min(span.first, channel.times.front()) : channel.times.front();
    span.last = moves ? std::max(span.last, channel.times.back()) : channel.times.back();
    moves =
        moves || std::find(tree.nodes.begin(), tree.nodes.end(), channel.node) != tree.nodes.end();
  }
  if (!moves) {
    throw DataError(
        file, "animation " + animation.name,
        "no channel that moves a joint of the skeleton of " + tree.skeleton.names[0].substr(0, 40),
        "rotations of the skin's joints");
  }
  return span;
}

// When frames are taken of an animation.
struct GltfFrames {
  double fps = kDefaultRate;
  std::vector<double> times;  // s
};

// At the asked rate, else at that of the keys where these are even. Throws DataError where they are
// more than `limits` has.
GltfFrames frames_of(const GltfAnimation& animation, GltfTimeSpan span,
                     const MotionOptions& options, const Limits& limits, const std::string& file) {
  const auto [first, last] = span;
  std::vector<double> keys = even_keys(animation);
  if (!keys.empty() && !(rate_of_even(keys) >= 1 && rate_of_even(keys) <= kMaxRate)) {
    keys.clear();  // the poses between which an animator lets it go
  }
  GltfFrames frames;
  frames.fps = options.fps > 0 ? options.fps : keys.empty() ? kDefaultRate : rate_of_even(keys);
  // At the keys themselves where these span the animation; times are rounded to float in the file,
  // which must not cost the last frame.
  const bool at_keys =
      options.fps <= 0 && !keys.empty() && keys.front() == first && keys.back() == last;
  const double count = at_keys ? static_cast<double>(keys.size())
                               : std::floor((last - first) * frames.fps + 1e-2) + 1;
  if (!(count >= 1 && count <= static_cast<double>(limits.frames))) {
    throw DataError(file, "animation " + animation.name, short_number(last - first) + " seconds",
                    "at most " + std::to_string(limits.frames) + " frames");
  }
  for (int frame = 0; frame < saturating_cast<int>(count); ++frame) {
    frames.times.push_back(at_keys ? keys[static_cast<std::size_t>(frame)]
                                   : first + frame / frames.fps);
  }
  return frames;
}

// Moves the nodes to where the animation has them; those lose their matrices.
void pose_nodes(const GltfAnimation& animation, double time, std::vector<GltfNode>& nodes) {
  for (const GltfChannel& channel : animation.channels) {
    if (channel.times.empty() || channel.node < 0 || channel.path == GltfPath::Weights) {
      continue;
    }
    GltfNode& node = nodes[static_cast<std::size_t>(channel.node)];
    node.matrix.reset();
    const Eigen::VectorXd value = sampled(channel, time);
    if (channel.path == GltfPath::Translation) {
      node.translation = value;
    } else if (channel.path == GltfPath::Rotation) {
      node.rotation = Eigen::Vector4d(value).normalized();
    } else {
      node.scale = value;
    }
  }
}

// A pose, and by how much its bones differ from the skeleton's.
struct GltfPose {
  Pose pose;
  double stretch = 0;  // m, the most
};

// The skeleton's pose where its joints' nodes are placed like that. Throws DataError where a joint
// has no axes.
GltfPose pose_of_nodes(const GltfSkeleton& tree, const std::vector<Eigen::Matrix4d>& world,
                       const GltfAnimation& animation, int path, const std::string& file) {
  const Skeleton& skeleton = tree.skeleton;
  const Index joints = static_cast<Index>(tree.nodes.size());
  GltfPose posed;
  posed.pose.rotations.resize(joints, 3);
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
    const int parent = skeleton.parents[row];
    const Eigen::Matrix3d above = parent < 0 ? Eigen::Matrix3d::Identity().eval()
                                             : rotations[static_cast<std::size_t>(parent)];
    const Eigen::Matrix3d before = above * rotation_matrix(skeleton.rest_rotations.row(j));
    posed.pose.rotations.row(j) = rotation_vector(before.transpose() * rotations[row]);
    const Eigen::Vector3d position = frame_of_joint.topRightCorner<3, 1>();
    if (parent < 0) {
      posed.pose.root_translation = position - skeleton.offsets.row(0).transpose();
    } else if (!is_on_path(skeleton, static_cast<int>(j), path)) {
      const Eigen::Vector3d parent_position =
          world[static_cast<std::size_t>(tree.nodes[static_cast<std::size_t>(parent)])]
              .topRightCorner<3, 1>();
      posed.stretch = std::max(posed.stretch, std::abs((position - parent_position).norm() -
                                                       skeleton.offsets.row(j).norm()));
    }
  }
  if (path > 0) {
    const int node = tree.nodes[static_cast<std::size_t>(path)];
    carry_by_root(skeleton, path, world[static_cast<std::size_t>(node)].topRightCorner<3, 1>(),
                  posed.pose);
  }
  return posed;
}

// Whether it moves a joint of the skin that is asked for, or of any.
bool moves_a_joint(const GltfScene& scene, const GltfAnimation& animation,
                   const std::optional<std::size_t>& wanted) {
  if (wanted) {
    return moves_joint_of(scene, animation, *wanted);
  }
  std::vector<char> joint(scene.nodes.size(), static_cast<char>(scene.skins.empty()));
  for (const GltfSkin& skin : scene.skins) {
    for (const int node : skin.joints) {
      joint[static_cast<std::size_t>(node)] = 1;
    }
  }
  return std::any_of(animation.channels.begin(), animation.channels.end(), [&](const auto& one) {
    return one.node >= 0 && joint[static_cast<std::size_t>(one.node)] != 0 &&
           (one.path == GltfPath::Rotation || one.path == GltfPath::Translation);
  });
}

// The animation that is asked for, or the first that moves a joint; others are named.
std::size_t chosen_animation(const GltfScene& scene, const MotionOptions& options,
                             const std::string& file, std::vector<Finding>& findings) {
  const std::string& wanted = options.animation;
  const std::size_t count = scene.animations.size();
  if (count == 0) {
    throw DataError(file, "animations", "none", "a motion");
  }
  std::vector<std::string> names;
  std::string listed;
  for (std::size_t a = 0; a < count; ++a) {
    names.push_back(scene.animations[a].name);
    if (a < 20) {
      listed += (a > 0 ? ", " : "") + std::to_string(a + 1) + " '" + names[a].substr(0, 40) + "'";
    }
  }
  listed += count > 20 ? ", ..." : "";
  if (!wanted.empty()) {
    const auto found = std::find(names.begin(), names.end(), wanted);
    std::int64_t number = 0;
    if (found != names.end()) {
      return static_cast<std::size_t>(found - names.begin());
    }
    if (parse_integer(wanted, number) && number >= 1 && std::cmp_less_equal(number, count)) {
      return static_cast<std::size_t>(number) - 1;
    }
    throw UnknownValue(file, "animation", wanted, listed + did_you_mean(wanted, names));
  }
  std::optional<std::size_t> skin;
  if (!options.skin.empty() && !scene.skins.empty()) {
    skin = named_skin(scene, options.skin, file);
  }
  std::size_t first = 0;
  while (first + 1 < count && !moves_a_joint(scene, scene.animations[first], skin)) {
    ++first;
  }
  if (count > 1) {
    findings.push_back({Severity::Warning, "motion-animations", file,
                        std::to_string(count) + " animations: " + listed,
                        std::to_string(first + 1) +
                            " is taken; --motion.animation NAME of body-model takes another"});
  }
  return first;
}

}  // namespace

MotionClip read_gltf_motion(const GltfScene& scene, const std::string& file,
                            const MotionOptions& options, const Limits& limits) {
  MotionClip clip;
  const GltfAnimation& animation =
      scene.animations[chosen_animation(scene, options, file, clip.findings)];
  GltfScene posed;
  posed.nodes = scene.nodes;
  posed.roots = scene.roots;
  for (GltfNode& node : posed.nodes) {
    node.mesh = node.skin = -1;
    node.weights.clear();
  }
  posed.skins = scene.skins.empty() ? skins_of_animation(scene, animation, file) : scene.skins;
  const std::size_t moving = moving_skin(scene.skins.empty() ? posed : scene, animation,
                                         options.skin, file, clip.findings);
  if (scene.skins.empty() && std::cmp_greater(posed.skins[moving].joints.size(), limits.joints)) {
    throw DataError(file, "animation " + animation.name,
                    std::to_string(posed.skins[moving].joints.size()) + " nodes below it",
                    "at most " + std::to_string(limits.joints) + " joints");
  }
  const int skin = static_cast<int>(moving);
  const std::vector<double> keys = even_keys(animation);
  if (keys.size() >= kManyKeys) {
    if (const auto odd = odd_frame_rate(rate_of_even(keys), RateStated::Keys, file)) {
      clip.findings.push_back(*odd);
    }
  }
  const GltfSkeleton tree = gltf_skeleton(posed, skin, file);
  const GltfFrames frames =
      frames_of(animation, time_span(animation, tree, file), options, limits, file);
  clip.name = animation.name.empty() ? file : animation.name;
  clip.skeleton = tree.skeleton;
  clip.findings.insert(clip.findings.end(), tree.findings.begin(), tree.findings.end());
  clip.motion.fps = frames.fps;
  const int path = path_joint(clip.skeleton);
  double stretch = 0;
  for (const double time : frames.times) {
    pose_nodes(animation, time, posed.nodes);
    GltfPose pose = pose_of_nodes(tree, world_from_nodes(posed), animation, path, file);
    stretch = std::max(stretch, pose.stretch);
    clip.motion.frame_ids.push_back(static_cast<int>(clip.motion.frame_ids.size()));
    clip.motion.poses.push_back(std::move(pose.pose));
  }
  if (stretch > kUnsaidStretch) {
    clip.findings.push_back({Severity::Warning, "motion-stretch", file,
                             "bones change their length, by up to " + short_number(stretch) + " m",
                             "the bones keep the length of the bind pose"});
  }
  check_motion_clip(clip, file);
  return clip;
}

MotionClip read_gltf_motion(const std::filesystem::path& path, const MotionOptions& options,
                            const Limits& limits) {
  MotionClip clip = read_gltf_motion(read_scene(path, limits), path.string(), options, limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
