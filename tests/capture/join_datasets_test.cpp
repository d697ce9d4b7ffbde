// Sequences of one rig in several folders as one capture, and what is held out in other layouts.
#include "capture/layouts/join_datasets.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/error.h"
#include "core/usage_error.h"
#include "tests/capture/small_capture.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class JoinedCapture : public ::testing::Test {
 protected:
  Dataset part(const std::string& name, const SmallCapture& capture = {}) const {
    write_small_capture(folder_ / name, capture);
    return open_dataset(folder_ / name, {});
  }
  static void expect_refused(const std::vector<Dataset>& parts, const char* words) {
    try {
      join_datasets(parts, {"clothed", "minimal"});
      ADD_FAILURE() << "expected DataError: " << words;
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }
  TemporaryDirectory folder_;
};

TEST_F(JoinedCapture, TwoParts_BecomeSequencesWithFramesOfTheirOwn) {
  SmallCapture second;
  second.frames = {0, 1, 4};
  second.consent = {{"P. Doe", "research", ""}};
  const Dataset all = join_datasets({part("a"), part("b", second)}, {"clothed", "minimal"});
  ASSERT_EQ(all.info.sequences.size(), 2U);
  EXPECT_EQ(all.info.sequences[0].name, "clothed");
  EXPECT_THAT(all.info.sequences[0].frame_ids, ElementsAre(3, 4));
  EXPECT_EQ(all.info.sequences[1].kind, "minimal");
  EXPECT_THAT(all.info.sequences[1].frame_ids, ElementsAre(5, 6, 9));
  EXPECT_EQ(all.info.consent, second.consent);
  EXPECT_EQ(all.findings.back().code, "frames-renumbered");
  const LayoutReport report = write_layout(all, "native", folder_ / "out");
  const Dataset back = open_dataset(folder_ / "out", {});
  EXPECT_EQ(back.info.sequences[1].frame_ids, all.info.sequences[1].frame_ids);
  FrameReader reader(back);
  // Frame 9 is what frame 4 of the second part was; a pixel says so.
  EXPECT_EQ(reader.byte_image(1, 9)->at(7, 9, 1), 4);
  EXPECT_EQ(reader.byte_image(1, 4)->at(7, 9, 1), 4);
  EXPECT_FALSE(reader.keypoints(0, 6).empty());
}

TEST_F(JoinedCapture, PartsOfOneKind_GetNumbers) {
  SmallCapture late;
  late.frames = {20, 21};
  const Dataset all = join_datasets({part("a"), part("b", late)}, {"clothed", "clothed"});
  EXPECT_EQ(all.info.sequences[1].name, "clothed_2");
  EXPECT_THAT(all.info.sequences[1].frame_ids, ElementsAre(20, 21));
}

TEST_F(JoinedCapture, MovedOrOtherCamera_IsNoRig) {
  SmallCapture moved;
  moved.cameras[1].camera_from_world_translation.x() += 0.01;
  expect_refused({part("a"), part("moved", moved)}, "mm off than in");
  SmallCapture zoomed;
  zoomed.cameras[2].fx *= 1.01;
  expect_refused({part("b"), part("zoomed", zoomed)}, "another lens");
  SmallCapture other;
  other.cameras[0].id = "left";
  expect_refused({part("c"), part("other", other)}, "camera 'left'");
}

TEST_F(JoinedCapture, CameraThatOnePartLacks_IsNamed) {
  SmallCapture fewer;
  fewer.cameras.pop_back();
  const Dataset all = join_datasets({part("a"), part("b", fewer)}, {"clothed", "minimal"});
  EXPECT_EQ(all.cameras.size(), 3U);
  EXPECT_EQ(all.frames[2].images.size(), 2U);
  EXPECT_THAT(all.findings, Contains(::testing::Field(&Finding::code, "camera-without-frames")));
}

TEST_F(JoinedCapture, OtherKindsOrCounts_AreRefused) {
  const std::vector<Dataset> parts = {part("a"), part("b")};
  EXPECT_THROW(join_datasets(parts, {"clothed"}), UsageError);
  EXPECT_THROW(join_datasets(parts, {"clothed", "naked"}), UsageError);
  EXPECT_THROW(join_datasets({parts[0]}, {"clothed"}), UsageError);
  Dataset several = parts[1];
  several.info.sequences.push_back({"more", "clothed", 12, {30}});
  expect_refused({parts[0], several}, "one in each part");
  Dataset of_another = parts[1];
  of_another.info.subject = "somebody else";
  expect_refused({parts[0], of_another}, "subject");
  Dataset in_other_order = parts[1];
  in_other_order.info.keypoint_schema = "coco_17";
  expect_refused({parts[0], in_other_order}, "keypoint schema");
}

TEST_F(JoinedCapture, HeldOutOfAnyPart_StaysHeldOut) {
  Dataset a = part("a");
  Dataset b = part("b");
  a.info.held_out_frames = {4};
  b.info.held_out_frames = {3};
  b.info.held_out_cameras = {b.cameras[0].id};
  const Dataset all = join_datasets({a, b}, {"clothed", "minimal"});
  EXPECT_THAT(all.info.held_out_frames, ElementsAre(4, 5));
  EXPECT_THAT(all.info.held_out_cameras, ElementsAre(b.cameras[0].id));
}

class HeldOut : public JoinedCapture, public ::testing::WithParamInterface<std::string> {};

INSTANTIATE_TEST_SUITE_P(Layouts, HeldOut, ::testing::ValuesIn(layout_names()),
                         [](const auto& layout) { return layout.param; });

TEST_P(HeldOut, OtherLayouts_NameIt) {
  Dataset dataset = part("a");
  dataset.info.held_out_cameras = {dataset.cameras[1].id};
  dataset.info.held_out_frames = {4};
  const LayoutReport report = write_layout(dataset, GetParam(), folder_ / "out");
  const auto named =
      Contains(HasSubstr("held-out cameras " + dataset.cameras[1].id + " and held-out frames 4"));
  if (GetParam() == "native") {
    EXPECT_THAT(report.lost, Not(named));
    EXPECT_EQ(open_dataset(folder_ / "out", {}).info.held_out_frames, dataset.info.held_out_frames);
  } else {
    EXPECT_THAT(report.lost, named);
  }
}

TEST_F(JoinedCapture, NerfstudioAndColmap_KeepHeldOutImagesApart) {
  Dataset dataset = part("a");
  const std::string held = dataset.cameras[1].id;
  dataset.info.held_out_cameras = {held};
  dataset.info.held_out_frames = {4};
  write_layout(dataset, "nerfstudio", folder_ / "nerf");
  const auto nerf =
      nlohmann::json::parse(read_text(folder_ / "nerf" / "clothed" / "transforms.json"));
  EXPECT_EQ(nerf.at("frames").size(), 6U);
  EXPECT_EQ(nerf.at("train_filenames").size(), 2U);  // two cameras, frame 3
  EXPECT_EQ(nerf.at("test_filenames").size(), 4U);
  EXPECT_EQ(nerf.at("val_filenames"), nerf.at("test_filenames"));
  for (const auto& name : nerf.at("train_filenames")) {
    EXPECT_THAT(name.get<std::string>(), Not(HasSubstr("/" + held + "_")));
    EXPECT_THAT(name.get<std::string>(), HasSubstr("000003"));
  }
  DatasetOptions as_written;
  as_written.metres_per_unit = 1;
  as_written.fps = 12;
  const Dataset back = open_dataset(folder_ / "nerf" / "clothed", as_written);
  EXPECT_THAT(back.info.held_out_cameras, ElementsAre(held));
  EXPECT_THAT(back.info.held_out_frames, ElementsAre(4));
  write_layout(dataset, "colmap", folder_ / "colmap");
  const std::string test = read_text(folder_ / "colmap" / "clothed" / "sparse/0/test.txt");
  EXPECT_EQ(std::count(test.begin(), test.end(), '\n'), 4);
  EXPECT_THAT(test, HasSubstr(held + "/000003.png\n"));
  EXPECT_THAT(test, HasSubstr(held + "/000004.png\n"));
  dataset.info.held_out_cameras.clear();
  dataset.info.held_out_frames.clear();
  write_layout(dataset, "colmap", folder_ / "open");
  EXPECT_FALSE(fs::exists(folder_ / "open" / "clothed" / "sparse/0/test.txt"));
}

}  // namespace
}  // namespace atelier::fixtures
