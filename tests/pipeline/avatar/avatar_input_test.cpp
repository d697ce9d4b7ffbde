#include "pipeline/avatar/avatar_input.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "core/error.h"
#include "core/label.h"
#include "core/sequence_archive.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A run that has inputs and listens.
class ListeningRun : public StageRun {
 public:
  std::map<std::string, fs::path, std::less<>> inputs;
  std::string heard;

  const fs::path& input(std::string_view kind) const override { return inputs.find(kind)->second; }
  bool has_input(std::string_view kind) const override { return inputs.contains(kind); }
  Device device() const override { return Device::Cpu; }
  bool each_frame(const std::vector<FrameFiles>& /*files*/, const std::vector<int>& /*frame_ids*/,
                  const std::function<void(int, std::span<const fs::path>)>& /*write*/,
                  std::int64_t /*bytes_per_frame*/) override {
    return false;
  }
  fs::path frame_file(int /*frame_id*/) const override { return {}; }
  void output(const std::string& /*path*/,
              const std::function<void(const fs::path&)>& /*write*/) override {}
  void output_text(const std::string& /*path*/, std::string_view /*text*/) override {}
  fs::path scratch_folder() override { return {}; }
  void metric(const std::string& /*name*/, double /*value*/) override {}
  void say(const std::string& line) override { heard += line + "\n"; }
  void warn(const std::string& line) override { heard += line + "\n"; }
  void progress(std::int64_t /*done*/, std::int64_t /*total*/, const std::string& /*unit*/,
                const std::vector<std::pair<std::string, double>>& /*figures*/) override {}
  bool stop_requested() override { return false; }
  void need_space(std::int64_t /*bytes*/) const override {}

 protected:
  const void* option_values() const override { return nullptr; }
};

/// Four clothed frames and three minimally clothed ones, the last of each held out, as is the first
/// camera; tracked, with scans of a ball.
class AvatarFrames : public ::testing::Test {
 protected:
  void SetUp() override {
    fixtures::SmallCapture capture;
    capture.frames = {0, 1, 2, 3, 4, 5, 6};
    capture.detections = false;
    fixtures::write_small_capture(folder_ / "capture", capture);
    CaptureInfo info = read_capture_info(folder_ / "capture");
    info.sequences = {{"clothed", "clothed", 12, {0, 1, 2, 3}},
                      {"minimal", "minimal", 12, {4, 5, 6}}};
    info.held_out_frames = {3, 6};
    info.held_out_cameras = {capture.cameras[0].id};
    write_file_atomically(folder_ / "capture" / "capture.toml", capture_toml(info));
    const PersonalBody person = plain_person(default_human(female_human()));
    fs::create_directories(folder_ / "person");
    write_personal_body(folder_ / "person" / "person.npz", person);
    fs::create_directories(folder_ / "tracked" / "tracked");
    write_take("clothed", {0, 1, 2, 3}, person);
    write_take("minimal", {4, 5, 6}, person);
    fs::create_directories(folder_ / "scans" / "scans");
    Mesh scan = fixtures::sphere(1);
    scan.labels.assign(static_cast<std::size_t>(scan.vertices.rows()),
                       static_cast<std::uint8_t>(Label::Hair));
    scan.labels[0] = static_cast<std::uint8_t>(Label::Dress);
    for (int id = 0; id < 7; ++id) {
      write_mesh_archive(folder_ / "scans" / "scans" / (frame_name(id) + ".h5"), scan);
    }
    for (const char* kind : {"capture", "person", "tracked", "scans"}) {
      run_.inputs[kind] = folder_ / kind;
    }
  }

  void write_take(const std::string& name, const std::vector<int>& ids,
                  const PersonalBody& person) const {
    TrackedMotion tracked;
    tracked.skeleton = person.model.skeleton;
    tracked.motion.fps = 12;
    tracked.motion.frame_ids = ids;
    const Pose pose = rest_pose(tracked.skeleton);
    const auto count = static_cast<Index>(ids.size());
    tracked.motion.poses.assign(ids.size(), pose);
    tracked.joints.assign(ids.size(), forward_kinematics(tracked.skeleton, pose).positions);
    tracked.deviations = RowMatrix::Zero(count, tracked.joints[0].rows());
    tracked.trusted.assign(ids.size(), 1);
    tracked.keypoint_rms = tracked.scan_rms = tracked.scan_share = Eigen::VectorXd::Zero(count);
    write_tracked_motion(folder_ / "tracked" / "tracked" / (name + ".h5"), tracked);
  }
  void remove_scan(int id) const {
    fs::remove(folder_ / "scans" / "scans" / (frame_name(id) + ".h5"));
  }

  fixtures::TemporaryDirectory folder_;
  ListeningRun run_;
};

TEST_F(AvatarFrames, HeldOutCamerasAndFrames_AreNotChosen) {
  const AvatarInput all = avatar_input(run_, AvatarKind::All, {});
  EXPECT_THAT(all.frame_ids, ElementsAre(0, 1, 2, 4, 5));
  EXPECT_THAT(all.minimal, ElementsAre(4, 5));
  ASSERT_EQ(all.cameras.size(), 2U);
  EXPECT_EQ(all.camera_idx.front(), 1);
  EXPECT_THAT(avatar_input(run_, AvatarKind::Minimal, {}).frame_ids, ElementsAre(4, 5));
  EXPECT_THAT(avatar_input(run_, AvatarKind::Underlying, {}).frame_ids, ElementsAre(0, 1, 2));
  EXPECT_THAT(run_.heard, HasSubstr("no registered garments"));
}

TEST_F(AvatarFrames, NoMinimalScan_TakesClothedFrames) {
  remove_scan(4);
  remove_scan(5);
  EXPECT_THAT(avatar_input(run_, AvatarKind::Minimal, {}).frame_ids, ElementsAre(0, 1, 2));
  EXPECT_THAT(run_.heard, HasSubstr("clothed ones are used"));
}

TEST_F(AvatarFrames, ClothedFramesWithoutLabels_AreLeftOut) {
  fs::remove_all(folder_ / "capture" / "labels");
  EXPECT_THAT(avatar_input(run_, AvatarKind::All, {}).frame_ids, ElementsAre(4, 5));
  EXPECT_THAT(run_.heard, HasSubstr("they are left out"));
  ATELIER_EXPECT_REFUSED(avatar_input(run_, AvatarKind::Underlying, {}), DataError, "stays grey");
}

TEST_F(AvatarFrames, OneFrame_IsSaid) {
  remove_scan(5);
  EXPECT_THAT(avatar_input(run_, AvatarKind::Minimal, {}).frame_ids, ElementsAre(4));
  EXPECT_THAT(run_.heard, HasSubstr("frame 4 is the only one"));
}

TEST_F(AvatarFrames, ClothesOfAScan_CountByTheKindOfFrame) {
  const AvatarInput input = avatar_input(run_, AvatarKind::All, {});
  EXPECT_EQ(avatar_scan(input, 4).roles[0], ScanRole::Skin);
  EXPECT_EQ(avatar_scan(input, 1).roles[0], ScanRole::Ignored);
  EXPECT_EQ(avatar_scan(input, 1).roles[1], ScanRole::Cover);
}

TEST_F(AvatarFrames, KeypointsOfTheFace_AreReadWhereTheCaptureHasThem) {
  EXPECT_TRUE(avatar_input(run_, AvatarKind::All, {}).faces.empty());
  const fs::path file = folder_ / "capture" / "capture.toml";
  CaptureInfo info = read_capture_info(folder_ / "capture");
  info.keypoint_schema = "coco_wholebody";
  write_file_atomically(file, capture_toml(info));
  EXPECT_TRUE(avatar_input(run_, AvatarKind::All, {}).faces.empty()) << "and none was found";
  fs::create_directories(folder_ / "scans" / "keypoints3d");
  const std::vector<std::string>& names = keypoint_schema("coco_wholebody").points;
  const int chin = find_keypoint(keypoint_schema("coco_wholebody"), "face_8");
  for (int id = 0; id < 7; ++id) {
    PersonPoints one{0, Keypoints3d::Ones(static_cast<Index>(names.size()), 4)};
    for (Index k = 0; k < one.points.rows(); ++k) {
      one.points.row(k).head<3>() << 0.02 * std::sin(k), 0.03 * std::cos(2.0 * k), 0.01 * k / 133;
    }
    one.points(chin, 1) -= id % 2 == 1 ? 0.02 : 0;
    write_file_atomically(folder_ / "scans" / "keypoints3d" / (frame_name(id) + ".json"),
                          keypoints3d_json(std::vector<PersonPoints>{one}));
  }
  const AvatarInput input = avatar_input(run_, AvatarKind::All, {});
  EXPECT_THAT(run_.heard, HasSubstr("conditioned on its 68 keypoints"));
  ASSERT_EQ(input.faces.size(), input.frame_ids.size());
  const std::vector<float>& still = input.faces.at(0);
  const std::vector<float>& talks = input.faces.at(1);
  ASSERT_EQ(still.size(), 3U * 68);
  EXPECT_NEAR(still[3 * 8 + 1] - talks[3 * 8 + 1], 2, 0.05) << "cm";
}

}  // namespace
}  // namespace atelier
