#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <set>

#include "bodymodel/euler.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/path_joint.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kStretch = 0.01;  // share of the height that bones may move unsaid
constexpr double kStays = 1e-3;    // share of its length that a bone moves by rounding

// One column of the motion block.
struct Channel {
  int joint;
  bool rotation;  // else position
  int axis;
};

bool equal_words(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           return std::tolower(static_cast<unsigned char>(x)) ==
                  std::tolower(static_cast<unsigned char>(y));
         });
}

// Words across lines; '{' and '}' are words of their own wherever they stand.
class Words {
 public:
  Words(TextScanner& scanner) : scanner_(scanner) {}

  std::string_view next(const char* expected) {
    while (pending_.empty()) {
      pending_ = scanner_.next_word();
      if (pending_.empty() && !scanner_.next_line()) {
        scanner_.fail("the end of the file", expected);
      }
    }
    std::size_t length = 1;
    if (pending_[0] != '{' && pending_[0] != '}') {
      length = std::min(pending_.find_first_of("{}"), pending_.size());
    }
    const std::string_view word = pending_.substr(0, length);
    pending_.remove_prefix(length);
    return word;
  }

  void expect(const char* word) {
    const std::string_view found = next(word);
    if (!equal_words(found, word)) {
      scanner_.fail(in_quotes(found), std::string("'") + word + "'");
    }
  }

  double number(const char* what) {
    const std::string_view word = next(what);
    double value = 0;
    if (!parse_number(word, value)) {
      scanner_.fail(no_number(word), std::string("a finite number for ") + what);
    }
    return value;
  }

  double length(const char* what, const Limits& limits) {
    const double value = number(what);
    if (!(std::abs(value) <= limits.mesh_coordinate)) {
      scanner_.fail(std::string(what) + " " + number_text(value),
                    "at most " + number_text(limits.mesh_coordinate));
    }
    return value;
  }

  std::int64_t integer(const char* what) {
    const std::string_view word = next(what);
    std::int64_t value = 0;
    if (!parse_integer(word, value)) {
      scanner_.fail(in_quotes(word), std::string("a whole number for ") + what);
    }
    return value;
  }

  // A joint's name: the words up to '{' or the end of the line.
  std::string name() {
    std::string name(next("a joint's name"));
    if (name == "{" || name == "}") {
      scanner_.fail(in_quotes(name), "a joint's name");
    }
    if (!pending_.empty()) {
      return name;  // a brace follows at once
    }
    for (std::string_view word = scanner_.next_word(); !word.empty(); word = scanner_.next_word()) {
      const std::size_t brace = word.find('{');
      if (brace != std::string_view::npos) {
        if (brace > 0) {
          name += ' ' + std::string(word.substr(0, brace));
        }
        pending_ = word.substr(brace);
        break;
      }
      name += ' ' + std::string(word);
    }
    return name;
  }

 private:
  TextScanner& scanner_;
  std::string_view pending_;
};

struct Hierarchy {
  std::vector<std::string> names;
  std::vector<int> parents;
  std::vector<Eigen::Vector3d> offsets;
  std::vector<EndSite> end_sites;
  std::vector<Channel> channels;
};

Eigen::Vector3d read_offset(Words& words, const Limits& limits) {
  words.expect("OFFSET");
  Eigen::Vector3d offset;
  for (int i = 0; i < 3; ++i) {
    offset[i] = words.length("OFFSET", limits);
  }
  return offset;
}

void read_channels(Words& words, TextScanner& scanner, int joint, std::vector<Channel>& channels) {
  const std::int64_t count = words.integer("the number of CHANNELS");
  if (count < 0 || count > 6) {
    scanner.fail(std::to_string(count) + " channels", "0 to 6");
  }
  std::set<std::pair<bool, int>> seen;
  for (std::int64_t i = 0; i < count; ++i) {
    const std::string_view word = words.next("a channel");
    const int axis = word.empty() ? -1 : std::toupper(static_cast<unsigned char>(word[0])) - 'X';
    const bool rotation = equal_words(word.substr(1), "rotation");
    if (axis < 0 || axis > 2 || !(rotation || equal_words(word.substr(1), "position"))) {
      scanner.fail("channel " + in_quotes(word), "X, Y or Z and position or rotation");
    }
    if (!seen.insert({rotation, axis}).second) {
      scanner.fail("channel " + in_quotes(word) + " twice", "each channel once");
    }
    channels.push_back({joint, rotation, axis});
  }
}

Hierarchy read_hierarchy(Words& words, TextScanner& scanner, const Limits& limits) {
  Hierarchy tree;
  words.expect("HIERARCHY");
  words.expect("ROOT");
  std::vector<int> open;  // joints whose '}' is still to come
  const auto begin_joint = [&] {
    if (static_cast<std::int64_t>(tree.names.size()) >= limits.joints) {
      scanner.fail("more joints", "at most " + std::to_string(limits.joints));
    }
    const int joint = static_cast<int>(tree.names.size());
    tree.names.push_back(words.name());
    tree.parents.push_back(open.empty() ? -1 : open.back());
    words.expect("{");
    tree.offsets.push_back(read_offset(words, limits));
    open.push_back(joint);
  };
  begin_joint();
  while (!open.empty()) {
    const std::string_view word = words.next("JOINT, End Site, CHANNELS or '}'");
    if (word == "}") {
      open.pop_back();
    } else if (equal_words(word, "JOINT")) {
      begin_joint();
    } else if (equal_words(word, "CHANNELS")) {
      const int joint = open.back();
      if (!tree.channels.empty() && tree.channels.back().joint >= joint) {
        scanner.fail("CHANNELS of joint '" + tree.names[static_cast<std::size_t>(joint)] +
                         "' twice or behind its children",
                     "CHANNELS once, before the children");
      }
      read_channels(words, scanner, joint, tree.channels);
    } else if (equal_words(word, "End")) {
      words.expect("Site");
      // Some writers name their end sites.
      std::string_view brace = words.next("'{'");
      if (brace != "{") {
        words.expect("{");
      }
      tree.end_sites.push_back({open.back(), read_offset(words, limits)});
      words.expect("}");
    } else {
      scanner.fail(in_quotes(word), "JOINT, End Site, CHANNELS or '}'");
    }
  }
  return tree;
}

// Names made unique: "arm", "arm_2".
void make_unique(std::vector<std::string>& names, const std::string& file,
                 std::vector<Finding>& findings) {
  std::set<std::string> seen;
  for (std::string& name : names) {
    if (seen.insert(name).second) {
      continue;
    }
    int number = 2;
    while (!seen.insert(name + "_" + std::to_string(number)).second) {
      ++number;
    }
    const std::string unique = name + "_" + std::to_string(number);
    findings.push_back({Severity::Warning, "motion-names", file,
                        "joint name '" + name + "' is used twice", "the later one is " + unique});
    name = unique;
  }
}

// The values of all frames, [frames, channels].
Eigen::MatrixXd read_frames(Words& words, TextScanner& scanner, Index channels,
                            const Limits& limits, double& seconds_per_frame) {
  const std::string_view begin = words.next("MOTION");
  if (equal_words(begin, "ROOT")) {
    scanner.fail(
        "a second ROOT, " + in_quotes(words.name()),
        "one skeleton: export each person of the scene alone, or leave the other roots and "
        "their values out");
  }
  if (!equal_words(begin, "MOTION")) {
    scanner.fail(in_quotes(begin), "'MOTION'");
  }
  words.expect("Frames:");
  const std::int64_t frames = words.integer("the number of frames");
  if (frames < 1 || frames > limits.frames) {
    scanner.fail(std::to_string(frames) + " frames", "1 to " + std::to_string(limits.frames));
  }
  words.expect("Frame");
  words.expect("Time:");
  seconds_per_frame = words.number("the frame time");
  if (!(seconds_per_frame > 0 && std::isfinite(1 / seconds_per_frame))) {
    scanner.fail("frame time " + short_number(seconds_per_frame), "seconds, more than 0");
  }
  // A value takes a digit and what parts it from the next.
  if (static_cast<std::uint64_t>(frames) * static_cast<std::uint64_t>(channels) * 2 >
      static_cast<std::uint64_t>(scanner.bytes_left()) + 2) {
    scanner.fail(std::to_string(scanner.bytes_left()) + " bytes of motion",
                 std::to_string(frames) + " frames of " + std::to_string(channels) +
                     " values (the file is cut off)");
  }
  Eigen::MatrixXd values(frames, channels);
  for (Index frame = 0; frame < frames; ++frame) {
    std::string_view word;
    while (word.empty()) {
      if (!scanner.next_line()) {
        scanner.fail("the end of the file after " + std::to_string(frame) + " frames",
                     std::to_string(frames) + " frames (the file is cut off)");
      }
      word = scanner.next_word();
    }
    Index column = 0;
    for (; !word.empty(); word = scanner.next_word(), ++column) {
      if (column < channels && !parse_number(word, values(frame, column))) {
        scanner.fail("value " + std::to_string(column + 1) + " is " + no_number(word),
                     "a finite number");
      }
    }
    if (column != channels) {
      scanner.fail(std::to_string(column) + " values in frame " + std::to_string(frame + 1),
                   std::to_string(channels) + ", one for each channel");
    }
  }
  while (scanner.next_line()) {
    if (!scanner.next_word().empty()) {
      scanner.fail("more text after frame " + std::to_string(frames),
                   "the end of the file (Frames: says " + std::to_string(frames) + ")");
    }
  }
  return values;
}

// What the position channels of a joint say.
struct Placement {
  std::array<Index, 3> columns = {-1, -1, -1};  // of x, y and z
  bool change = false;                          // of the OFFSET; else a place in the parent

  bool any() const { return columns[0] >= 0 || columns[1] >= 0 || columns[2] >= 0; }

  // Where the joint is in its parent; axes without a channel keep their OFFSET.
  Eigen::Vector3d at(const Eigen::MatrixXd& values, Index frame,
                     const Eigen::Vector3d& offset) const {
    Eigen::Vector3d place = offset;
    for (int axis = 0; axis < 3; ++axis) {
      const Index column = columns[static_cast<std::size_t>(axis)];
      if (column >= 0) {
        place[axis] = values(frame, column) + (change ? offset[axis] : 0);
      }
    }
    return place;
  }
};

std::vector<Placement> placements_of(const Hierarchy& tree, const Eigen::MatrixXd& values) {
  std::vector<Placement> placements(tree.names.size());
  for (Index c = 0; c < values.cols(); ++c) {
    const Channel& channel = tree.channels[static_cast<std::size_t>(c)];
    if (!channel.rotation) {
      placements[static_cast<std::size_t>(channel.joint)]
          .columns[static_cast<std::size_t>(channel.axis)] = c;
    }
  }
  for (std::size_t j = 1; j < placements.size(); ++j) {
    if (placements[j].any()) {
      const Eigen::Vector3d first = placements[j].at(values, 0, Eigen::Vector3d::Zero());
      placements[j].change = first.norm() < (first - tree.offsets[j]).norm();
    }
  }
  // Positions of the root that are zero throughout leave it at its OFFSET.
  Placement& root = placements[0];
  root.change = true;
  for (const Index column : root.columns) {
    root.change = root.change && (column < 0 || values.col(column).isZero(0));
  }
  return placements;
}

// How far a joint goes from a place in its parent.
double most_from(const Placement& placement, const Eigen::MatrixXd& values,
                 const Eigen::Vector3d& offset, const Eigen::Vector3d& from) {
  double most = 0;
  for (Index frame = 0; frame < values.rows(); ++frame) {
    most = std::max(most, (placement.at(values, frame, offset) - from).norm());
  }
  return most;
}

// Bones as the channels say where they say one: of a joint whose OFFSET is zero, or that stays.
void set_bones(const Hierarchy& tree, const Eigen::MatrixXd& values,
               const std::vector<Placement>& placements, Skeleton& skeleton) {
  for (std::size_t j = 1; j < placements.size(); ++j) {
    if (!placements[j].any() || placements[j].change) {
      continue;
    }
    const Eigen::Vector3d& offset = tree.offsets[j];
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (Index frame = 0; frame < values.rows(); ++frame) {
      mean += placements[j].at(values, frame, offset) / static_cast<double>(values.rows());
    }
    const bool stays = most_from(placements[j], values, offset, mean) <= kStays * mean.norm();
    if (offset.isZero(0) || stays) {
      skeleton.offsets.row(static_cast<Index>(j)) = mean;
    }
  }
  const int path = path_joint(skeleton);
  for (int j = 1; j <= path; ++j) {
    if (is_on_path(skeleton, j, path)) {  // they are where a person goes, and no bones
      skeleton.offsets.row(j) = tree.offsets[static_cast<std::size_t>(j)];
    }
  }
}

void report_stretch(const Hierarchy& tree, const Eigen::MatrixXd& values,
                    const std::vector<Placement>& placements, int path, MotionClip& clip) {
  const double height = rest_extent(clip).maxCoeff();
  if (placements.size() > 1 && !(height > 0)) {
    throw DataError(clip.name, "HIERARCHY", "every OFFSET 0, and no positions that say bones",
                    "a skeleton with bones");
  }
  Index stretched = 0;
  double most = 0;
  for (std::size_t j = 1; j < placements.size(); ++j) {
    if (!placements[j].any() || is_on_path(clip.skeleton, static_cast<int>(j), path)) {
      continue;
    }
    const double moved = most_from(placements[j], values, tree.offsets[j],
                                   clip.skeleton.offsets.row(static_cast<Index>(j)));
    stretched += moved > kStretch * height ? 1 : 0;
    most = std::max(most, moved);
  }
  if (stretched > 0) {
    clip.findings.push_back({Severity::Warning, "motion-stretch", clip.name,
                             std::to_string(stretched) + " bones change their length, by up to " +
                                 percent(most / height) + " of the height",
                             "the bones keep one length"});
  }
}

// The pose of a frame: rotations by their channels, the root where it and the joints down to
// `path` take the person.
Pose pose_of_frame(const Hierarchy& tree, const Eigen::MatrixXd& values, Index frame,
                   const std::vector<Placement>& placements, int path, const Skeleton& skeleton) {
  const auto joints = static_cast<Index>(tree.names.size());
  std::vector<Eigen::Matrix3d> rotations(tree.names.size(), Eigen::Matrix3d::Identity());
  for (Index c = 0; c < values.cols(); ++c) {
    const Channel& channel = tree.channels[static_cast<std::size_t>(c)];
    if (channel.rotation) {
      Eigen::Matrix3d& rotation = rotations[static_cast<std::size_t>(channel.joint)];
      rotation = rotation * axis_rotation(channel.axis, kRadians * values(frame, c));
    }
  }
  Pose pose;
  pose.rotations.resize(joints, 3);
  for (Index j = 0; j < joints; ++j) {
    pose.rotations.row(j) = rotation_vector(rotations[static_cast<std::size_t>(j)]);
  }
  Eigen::Vector3d place = placements[0].at(values, frame, tree.offsets[0]);
  pose.root_translation = place - tree.offsets[0];
  if (path > 0) {
    Eigen::Matrix3d turn = rotations[0];
    for (int j = 1; j <= path; ++j) {
      if (is_on_path(skeleton, j, path)) {
        const std::size_t row = static_cast<std::size_t>(j);
        place += turn * placements[row].at(values, frame, tree.offsets[row]);
        turn = turn * rotations[row];
      }
    }
    carry_by_root(skeleton, path, place, pose);
  }
  return pose;
}

// No coordinate of a stage is that large, and sums of squares must stay finite.
void check_positions(const Hierarchy& tree, const Eigen::MatrixXd& values, const std::string& name,
                     const Limits& limits) {
  for (Index c = 0; c < values.cols(); ++c) {
    const Channel& channel = tree.channels[static_cast<std::size_t>(c)];
    Index frame = 0;
    const double most = values.col(c).cwiseAbs().maxCoeff(&frame);
    if (!channel.rotation && !(most <= limits.mesh_coordinate)) {
      throw DataError(name, "frame " + std::to_string(frame + 1),
                      "a position of " + number_text(most) + " of " +
                          tree.names[static_cast<std::size_t>(channel.joint)],
                      "at most " + number_text(limits.mesh_coordinate));
    }
  }
}

// Angles that are all below a turn in radians: of a person who moves they are radians.
void doubt_degrees(const Hierarchy& tree, const Eigen::MatrixXd& values, MotionClip& clip) {
  constexpr double kTurn = 2 * std::numbers::pi;
  constexpr double kMoves = 0.5;  // a person in radians turns some joint by that
  double largest = 0;
  double widest = 0;
  for (Index c = 0; c < values.cols(); ++c) {
    if (tree.channels[static_cast<std::size_t>(c)].rotation) {
      largest = std::max(largest, values.col(c).cwiseAbs().maxCoeff());
      widest = std::max(widest, values.col(c).maxCoeff() - values.col(c).minCoeff());
    }
  }
  if (largest < kTurn && widest > kMoves && find_humanoid(clip.skeleton)) {
    clip.findings.push_back({Severity::Warning, "motion-radians", clip.name,
                             "no angle is beyond " + short_number(largest) +
                                 ": they look like radians, and BVH has degrees",
                             "multiply them by 57.29578, unless the person hardly moves"});
  }
}

}  // namespace

MotionClip read_bvh(std::span<const std::byte> bytes, const std::string& name,
                    const MotionOptions& options, const Limits& limits) {
  TextScanner scanner(as_text(bytes), name, limits.line_bytes);
  Words words(scanner);
  Hierarchy tree = read_hierarchy(words, scanner, limits);
  const Index channels = static_cast<Index>(tree.channels.size());
  if (channels == 0) {
    scanner.fail("no channels", "a joint that moves");
  }
  double seconds_per_frame = 0;
  const Eigen::MatrixXd values = read_frames(words, scanner, channels, limits, seconds_per_frame);
  check_positions(tree, values, name, limits);

  MotionClip clip;
  clip.name = name;
  make_unique(tree.names, name, clip.findings);
  const Index joints = static_cast<Index>(tree.names.size());
  clip.skeleton.names = tree.names;
  clip.skeleton.parents = tree.parents;
  clip.skeleton.offsets.resize(joints, 3);
  for (Index j = 0; j < joints; ++j) {
    clip.skeleton.offsets.row(j) = tree.offsets[static_cast<std::size_t>(j)];
  }
  clip.end_sites = tree.end_sites;
  const std::vector<Placement> placements = placements_of(tree, values);
  set_bones(tree, values, placements, clip.skeleton);
  const int path = path_joint(clip.skeleton);
  report_stretch(tree, values, placements, path, clip);

  doubt_degrees(tree, values, clip);
  clip.motion.fps = frame_rate(seconds_per_frame);
  for (Index frame = 0; frame < values.rows(); ++frame) {
    clip.motion.poses.push_back(
        pose_of_frame(tree, values, frame, placements, path, clip.skeleton));
    clip.motion.frame_ids.push_back(static_cast<int>(frame));
  }
  clip = in_metres_y_up(std::move(clip), options);
  check_motion_clip(clip, name);
  return clip;
}

MotionClip read_bvh(const std::filesystem::path& path, const MotionOptions& options,
                    const Limits& limits) {
  MotionClip clip =
      read_bvh(read_file_bytes(path, limits.motion_file_bytes), path.string(), options, limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
