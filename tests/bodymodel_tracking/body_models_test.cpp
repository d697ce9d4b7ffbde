// People are measured and followed with any body model: the default human and MakeHuman.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/bone_lengths.h"
#include "bodymodel/formats/body_file.h"
#include "bodymodel/tracking/personalize.h"
#include "core/normals.h"
#include "tests/bodymodel_tracking/posed_person.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

constexpr int kFrames = 4;

/// Somebody whose bones and surface the model does not have.
BodyModel somebody_like(const BodyModel& model) {
  const BodyModel bones = with_bone_lengths(model);
  Eigen::VectorXd shape = neutral_shape(bones);
  for (const auto& [name, more] : {std::pair{"thigh_length", 0.012},
                                   {"forearm_length", -0.01},
                                   {"trunk_length", 0.012},
                                   {"size", 0.03}}) {
    if (const int s = find_shape(bones, name); s >= 0) {
      shape[s] += more;
    }
  }
  BodyModel person = plain_person(bones, shape).model;
  const Points normals = vertex_normals(person.mesh.vertices, person.mesh.faces);
  for (Index v = 0; v < vertex_count(person); ++v) {
    person.mesh.vertices.row(v) +=
        0.005 * std::sin(18 * person.mesh.vertices(v, 1)) * normals.row(v);
  }
  return person;
}

/// Turns every joint a little, and walks.
Eigen::VectorXd moving(const FittedPerson& person, int frame) {
  Random random{30};
  Eigen::VectorXd x = pose_variables(person, rest_pose(person.shaped.skeleton));
  for (Index i = 0; i < x.size(); ++i) {
    const double most = i < 3 ? 0.3 : person.stiffness[i] > 2 ? 0.06 : 0.3;
    const double phase = 6 * uniform(random);
    x[i] += most * std::sin(phase + 0.5 * frame);
  }
  return x;
}

void is_measured_and_followed(const BodyModel& model) {
  const BodyModel person = somebody_like(model);
  const FittedPerson fitted = fitted_person(person, body_25_names());
  Random random{6};
  TrackInput input;
  input.keypoint_names = body_25_names();
  input.fps = 12;
  for (int f = 0; f < kFrames; ++f) {
    const Eigen::VectorXd x = moving(fitted, f);
    const FrameTargets seen = keypoints_of(fitted, x, 0.004, random);
    Mesh scan;
    scan.vertices = skin_vertices(person, pose_of_variables(fitted, x));
    scan.faces = person.mesh.faces;
    const std::vector<ScanPart> skin(static_cast<std::size_t>(scan.vertices.rows()),
                                     ScanPart::Skin);
    input.frame_ids.push_back(f);
    input.frames.push_back({seen.keypoints, seen.deviations, scan_points(scan, skin)});
  }
  PersonalizeOptions options;
  options.samples = 1200;
  options.shape_rounds = 3;
  options.surface_rounds = 2;
  const Personalization found = personalize(model, input, options);
  EXPECT_LT(found.scan_rms, 0.003);
  TrackOptions tracking;
  tracking.samples = 1000;
  const Tracking tracked = track(found.person.model, input, tracking);
  double error = 0;
  for (int f = 0; f < kFrames; ++f) {
    const auto i = static_cast<std::size_t>(f);
    EXPECT_EQ(tracked.tracked.trusted[i], 1);
    const Points real =
        forward_kinematics(fitted.shaped.skeleton, pose_of_variables(fitted, moving(fitted, f)))
            .positions;
    for (const int joint : fitted.joints) {
      error += (tracked.tracked.joints[i].row(joint) - real.row(joint)).norm() /
               static_cast<double>(kFrames * fitted.joints.size());
    }
  }
  std::printf("joints %.1f mm, scans %.1f mm\n", 1e3 * error, 1e3 * found.scan_rms);
  EXPECT_LT(error, 0.012);
}

TEST(TrackedModels, DefaultHuman_IsMeasuredAndTracked) {
  is_measured_and_followed(read_body_file("default").model);
}

TEST(TrackedModels, MakeHumanBody_IsMeasuredAndTracked) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  is_measured_and_followed(read_body_file(base).model);
}

}  // namespace
}  // namespace atelier::fixtures
