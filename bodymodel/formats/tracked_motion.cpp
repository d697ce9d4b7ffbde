#include "bodymodel/formats/tracked_motion.h"

#include <cmath>

#include "core/check_bounded.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr const char* kSchema = "atelier.tracked";
constexpr int kVersion = 1;

Tensor texts(const std::vector<std::string>& values) {
  Tensor tensor{ElementType::Text, {static_cast<std::int64_t>(values.size())}, {}, {}};
  tensor.strings = values;
  return tensor;
}

/// A dataset that HDF5 can hold: those without elements are left out.
void put(Archive& archive, const char* name, Tensor tensor) {
  if (element_count(tensor) > 0) {
    archive.datasets[name] = std::move(tensor);
  }
}

class TrackedMotionReader {
 public:
  TrackedMotionReader(const Archive& archive, std::string file)
      : archive_(archive), file_(std::move(file)) {}

  [[noreturn]] void fail(const char* name, const std::string& found,
                         const std::string& expected) const {
    throw DataError(file_, name, found, expected);
  }

  const Tensor* find(const char* name) const {
    const auto at = archive_.datasets.find(name);
    return at == archive_.datasets.end() ? nullptr : &at->second;
  }

  const Tensor& tensor(const char* name) const {
    const Tensor* found = find(name);
    if (found == nullptr) {
      fail(name, "no such dataset", std::string("one of schema ") + kSchema);
    }
    return *found;
  }

  RowMatrix matrix(const char* name, Index rows, Index columns) const {
    const Tensor& t = tensor(name);
    check_bounded(t, Limits{}.mesh_coordinate, file_, name);
    RowMatrix values = matrix_of(t, columns, file_, name);
    if (values.rows() != rows) {
      fail(name, std::to_string(values.rows()) + " rows", std::to_string(rows));
    }
    return values;
  }

  Eigen::VectorXd list(const char* name, Index count) const {
    const Tensor& t = tensor(name);
    check_bounded(t, Limits{}.mesh_coordinate, file_, name);
    const std::vector<double> values = doubles_of(t, file_, name);
    if (static_cast<Index>(values.size()) != count) {
      fail(name, std::to_string(values.size()) + " values", std::to_string(count));
    }
    return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
  }

  std::vector<int> integers(const char* name, int least, int most) const {
    std::vector<int> values;
    for (const std::int64_t value : integers_of(tensor(name), file_, name)) {
      if (value < least || value > most) {
        fail(name, std::to_string(value),
             "numbers from " + std::to_string(least) + " to " + std::to_string(most));
      }
      values.push_back(static_cast<int>(value));
    }
    return values;
  }

 private:
  const Archive& archive_;
  std::string file_;
};

constexpr int kMaxIndex = 2'000'000'000;
constexpr int kLargestFrameId = 10'000'000;

}  // namespace

void check_tracked_motion(const TrackedMotion& tracked, const std::string& file) {
  check_skeleton(tracked.skeleton, file);
  const auto expect = [&](bool good, const char* where, const char* found, const char* expected) {
    if (!good) {
      throw DataError(file, where, found, expected);
    }
  };
  const std::size_t frames = tracked.motion.poses.size();
  const auto rows = static_cast<Index>(frames);
  const auto joints = static_cast<Index>(tracked.skeleton.names.size());
  expect(std::isfinite(tracked.motion.fps) && tracked.motion.fps > 0, "fps", "no rate",
         "frames per second above 0");
  expect(tracked.motion.frame_ids.size() == frames && tracked.joints.size() == frames &&
             tracked.trusted.size() == frames && tracked.deviations.rows() == rows &&
             tracked.keypoint_rms.size() == rows && tracked.scan_rms.size() == rows &&
             tracked.scan_share.size() == rows,
         "frame_ids", "arrays of different lengths", "one entry for each frame in all of them");
  expect(rows == 0 || tracked.deviations.cols() == joints, "deviations", "another width",
         "one for each joint");
  for (std::size_t f = 0; f < frames; ++f) {
    const Pose& pose = tracked.motion.poses[f];
    expect(f == 0 || tracked.motion.frame_ids[f] > tracked.motion.frame_ids[f - 1], "frame_ids",
           "numbers out of order", "increasing ones");
    expect(pose.rotations.rows() == joints && tracked.joints[f].rows() == joints, "rotations",
           "another number of joints", "as many as the skeleton has");
    expect(pose.rotations.allFinite() && pose.root_translation.allFinite() &&
               tracked.joints[f].allFinite(),
           "rotations", "a number that is not finite", "finite ones");
  }
  expect(tracked.deviations.allFinite() && (tracked.deviations.array() >= 0).all(), "deviations",
         "a negative number or none", "metres of at least 0");
  expect(tracked.keypoint_rms.allFinite() && tracked.scan_rms.allFinite() &&
             tracked.scan_share.allFinite(),
         "keypoint_rms", "a number that is not finite", "finite ones");
  for (std::size_t i = 0; i < tracked.region.size(); ++i) {
    expect(tracked.region[i] >= 0 && (i == 0 || tracked.region[i] > tracked.region[i - 1]),
           "region", "vertices out of order", "increasing ones");
  }
}

Archive archive_of(const TrackedMotion& tracked) {
  check_tracked_motion(tracked);
  Archive archive;
  archive.schema = kSchema;
  archive.version = kVersion;
  archive.numbers["fps"] = tracked.motion.fps;
  const Skeleton& skeleton = tracked.skeleton;
  put(archive, "joint_names", texts(skeleton.names));
  put(archive, "parents", tensor_of(skeleton.parents));
  put(archive, "offsets", tensor_of(RowMatrix(skeleton.offsets)));
  put(archive, "rest_rotations", tensor_of(RowMatrix(skeleton.rest_rotations)));
  put(archive, "limits_min", tensor_of(RowMatrix(skeleton.limits_min)));
  put(archive, "limits_max", tensor_of(RowMatrix(skeleton.limits_max)));
  const auto frames = static_cast<Index>(tracked.motion.poses.size());
  const auto joints = static_cast<Index>(skeleton.names.size());
  RowMatrix translations(frames, 3);
  RowMatrix rotations(frames, 3 * joints);
  RowMatrix places(frames, 3 * joints);
  Eigen::VectorXd trusted(frames);
  for (Index f = 0; f < frames; ++f) {
    const auto i = static_cast<std::size_t>(f);
    const Pose& pose = tracked.motion.poses[i];
    translations.row(f) = pose.root_translation.transpose();
    rotations.row(f) = Eigen::Map<const Eigen::RowVectorXd>(pose.rotations.data(), 3 * joints);
    places.row(f) = Eigen::Map<const Eigen::RowVectorXd>(tracked.joints[i].data(), 3 * joints);
    trusted[f] = tracked.trusted[i] ? 1 : 0;
  }
  put(archive, "frame_ids", tensor_of(tracked.motion.frame_ids));
  put(archive, "root_translations", tensor_of(translations));
  put(archive, "rotations", tensor_of(rotations));
  put(archive, "joints", tensor_of(places));
  put(archive, "deviations", tensor_of(tracked.deviations));
  put(archive, "trusted", tensor_of(trusted));
  put(archive, "keypoint_rms", tensor_of(tracked.keypoint_rms));
  put(archive, "scan_rms", tensor_of(tracked.scan_rms));
  put(archive, "scan_share", tensor_of(tracked.scan_share));
  put(archive, "region", tensor_of(tracked.region));
  return archive;
}

TrackedMotion tracked_motion_of(const Archive& archive, const std::string& file) {
  const TrackedMotionReader reader(archive, file);
  TrackedMotion tracked;
  Skeleton& skeleton = tracked.skeleton;
  const Tensor& names = reader.tensor("joint_names");
  if (names.type != ElementType::Text || names.shape.size() != 1) {
    reader.fail("joint_names", element_type_name(names.type), "a list of names");
  }
  skeleton.names = names.strings;
  const auto joints = static_cast<Index>(skeleton.names.size());
  skeleton.parents = reader.integers("parents", -1, kMaxIndex);
  skeleton.offsets = reader.matrix("offsets", joints, 3);
  const std::pair<const char*, Points*> optional[] = {{"rest_rotations", &skeleton.rest_rotations},
                                                      {"limits_min", &skeleton.limits_min},
                                                      {"limits_max", &skeleton.limits_max}};
  for (const auto& [name, points] : optional) {
    if (reader.find(name) != nullptr) {
      *points = reader.matrix(name, joints, 3);
    }
  }
  const auto fps = archive.numbers.find("fps");
  if (fps == archive.numbers.end()) {
    reader.fail("fps", "no such number", "frames per second");
  }
  tracked.motion.fps = fps->second;
  if (reader.find("frame_ids") == nullptr) {
    tracked.deviations.resize(0, joints);
    check_tracked_motion(tracked, file);
    return tracked;
  }
  tracked.motion.frame_ids = reader.integers("frame_ids", 0, kLargestFrameId);
  const auto frames = static_cast<Index>(tracked.motion.frame_ids.size());
  const RowMatrix translations = reader.matrix("root_translations", frames, 3);
  const RowMatrix rotations = reader.matrix("rotations", frames, 3 * joints);
  const RowMatrix places = reader.matrix("joints", frames, 3 * joints);
  const Eigen::VectorXd trusted = reader.list("trusted", frames);
  for (Index f = 0; f < frames; ++f) {
    Pose pose;
    pose.root_translation = translations.row(f).transpose();
    pose.rotations = Eigen::Map<const Points>(rotations.row(f).data(), joints, 3);
    tracked.motion.poses.push_back(std::move(pose));
    tracked.joints.emplace_back(Eigen::Map<const Points>(places.row(f).data(), joints, 3));
    tracked.trusted.push_back(trusted[f] != 0 ? 1 : 0);
  }
  tracked.deviations = reader.matrix("deviations", frames, joints);
  tracked.keypoint_rms = reader.list("keypoint_rms", frames);
  tracked.scan_rms = reader.list("scan_rms", frames);
  tracked.scan_share = reader.list("scan_share", frames);
  if (reader.find("region") != nullptr) {
    tracked.region = reader.integers("region", 0, kMaxIndex);
  }
  check_tracked_motion(tracked, file);
  return tracked;
}

void write_tracked_motion(const std::filesystem::path& path, const TrackedMotion& tracked) {
  write_archive(path, archive_of(tracked));
}

TrackedMotion read_tracked_motion(const std::filesystem::path& path, const Limits& limits) {
  return tracked_motion_of(read_archive(path, kSchema, kVersion, limits), path.string());
}

}  // namespace atelier
