// The stages personalize, track and body on a published recording.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/measure.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

// The stages on real 2D keypoints alone, against the published triangulation of the same
// detections.
TEST(PersonOfARealTrial, RealTrial_IsTrackedByTheCommands) {
  ATELIER_TEST_FILE(trial, "pose2sim_demo/single");
  const TemporaryDirectory own;
  const std::string workspace = (own.path() / "workspace").string();
  for (std::vector<std::string> step :
       std::vector<std::vector<std::string>>{{"reconstruct", "--capture.layout", "pose2sim"},
                                             {"personalize", "--input.capture.layout", "pose2sim"},
                                             {"track", "--input.capture.layout", "pose2sim"},
                                             {"body"}}) {
    const bool last = step.front() == "body";
    step.insert(step.begin() + 1, {trial.string(), workspace});
    step.insert(step.begin(), program_path());
    const ChildResult result = run_child(step);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("measure-implausible")));
    if (last) {  // bodies that nothing but keypoints says are there, and not to be trusted
      EXPECT_THAT(result.err, HasSubstr("no-scan [frames 0, 1, 2, 3, 4, 5, 6, 7 and 92 others]"));
      EXPECT_THAT(result.out, HasSubstr("untrusted 100 frames"));
    }
  }
  const BodyMeasurements person = measure_body(
      read_personal_body(fs::path(workspace) / "personalize" / "current" / "person.npz").model);
  std::printf("calf %.3f m, forearm %.3f m, %.1f kg\n", person.calf_girth, person.forearm_girth,
              person.mass);
  EXPECT_NEAR(person.calf_girth, 0.37, 0.06);
  EXPECT_NEAR(person.forearm_girth, 0.24, 0.04);
  EXPECT_NEAR(person.mass, 68, 12);
  const TrackedMotion found =
      read_tracked_motion(fs::path(workspace) / "track" / "current" / "tracked" / "capture.h5");
  const MarkerClip clip =
      read_trc(trial / "pose-3d_reference/S00_P00_T01_BalancingTrial_0-100.trc");
  ASSERT_EQ(found.joints.size(), clip.positions.size());
  const std::pair<const char*, const char*> names[] = {
      {"LHip", "left_hip"},      {"LKnee", "left_knee"},
      {"LAnkle", "left_ankle"},  {"LShoulder", "left_shoulder"},
      {"LElbow", "left_elbow"},  {"LWrist", "left_wrist"},
      {"RHip", "right_hip"},     {"RKnee", "right_knee"},
      {"RAnkle", "right_ankle"}, {"RShoulder", "right_shoulder"},
      {"RElbow", "right_elbow"}, {"RWrist", "right_wrist"}};
  EXPECT_THAT(found.trusted, ::testing::Each(1));
  std::vector<double> errors;
  double jump = 0;
  int flips = 0;
  const int left = find_joint(found.skeleton, "left_hip");
  const int right = find_joint(found.skeleton, "right_hip");
  for (std::size_t f = 0; f < found.joints.size(); ++f) {
    for (const auto& [marker, name] : names) {
      const auto m = std::find(clip.markers.begin(), clip.markers.end(), marker);
      ASSERT_NE(m, clip.markers.end()) << marker;
      const auto row = m - clip.markers.begin();
      const int joint = find_joint(found.skeleton, name);
      ASSERT_GE(joint, 0) << name;
      if (clip.seen[f][static_cast<std::size_t>(row)]) {
        const Eigen::RowVector3d at = clip.positions[f].row(row);  // Pose2Sim's world is turned
        const Eigen::RowVector3d ours(at.z(), at.y(), -at.x());
        errors.push_back((found.joints[f].row(joint) - ours).norm());
      }
    }
    const Points& before = found.joints[f > 0 ? f - 1 : 0];
    jump = std::max(jump, (found.joints[f] - before).rowwise().norm().maxCoeff());
    flips += (found.joints[f].row(left) - found.joints[f].row(right))
                         .dot(before.row(left) - before.row(right)) < 0
                 ? 1
                 : 0;
  }
  std::nth_element(errors.begin(), errors.begin() + std::ssize(errors) / 2, errors.end());
  std::printf("median %.1f mm over %zu joints, largest step %.1f mm a frame, %d flips\n",
              1e3 * errors[errors.size() / 2], errors.size(), 1e3 * jump, flips);
  EXPECT_LT(jump, 0.09);
  EXPECT_LT(errors[errors.size() / 2], 0.035);
  EXPECT_EQ(flips, 0);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
