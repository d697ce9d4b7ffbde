#include "bodymodel/formats/body_archive.h"

#include <cmath>
#include <cstdlib>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Arrays = std::map<std::string, Tensor>;

BodyModel whole_body() {
  BodyModel model = fixtures::synthetic_body();
  model.skeleton.limits_min = Points::Constant(7, 3, -1);
  model.skeleton.limits_max = Points::Constant(7, 3, 1);
  model.regressor.assign(7, {{1, 2}, {0.25, 0.75}});
  return model;
}

TEST(BodyArchive, WrittenBody_ReadsBackBitExact) {
  const fixtures::TemporaryDirectory folder;
  const BodyModel model = whole_body();
  write_body(folder / "body.npz", model);
  const BodyModel back = read_body(folder / "body.npz");
  EXPECT_EQ(back.name, model.name);
  EXPECT_EQ(back.skeleton.names, model.skeleton.names);
  EXPECT_EQ(back.skeleton.limits_max, model.skeleton.limits_max);
  EXPECT_EQ(back.shape[0].unit, "m");
  EXPECT_EQ(back.shape[1].surface.vertices, model.shape[1].surface.vertices);
  EXPECT_EQ(back.groups[0].vertices, model.groups[0].vertices);
  EXPECT_EQ(back.regressor[3].weights, model.regressor[3].weights);
  const Pose pose = fixtures::random_pose(model.skeleton, 4);
  const Eigen::Vector2d shape(1.8, 0.4);
  EXPECT_EQ(skin_vertices(back, pose, shape), skin_vertices(model, pose, shape));
}

TEST(BodyArchive, PlainBody_ReadsBackEqual) {
  const BodyModel model = fixtures::person_body(fixtures::person_skeleton());
  const BodyModel back = body_of_arrays(Npz(npz_bytes(body_arrays(model)), "p.npz"));
  EXPECT_TRUE(back.shape.empty());
  EXPECT_TRUE(back.correctives.empty());
  EXPECT_TRUE(back.regressor.empty());
  EXPECT_EQ(back.mesh.vertices, model.mesh.vertices);
}

TEST(BodyArchive, WrittenMotion_ReadsBackBitExact) {
  const fixtures::TemporaryDirectory folder;
  MotionClip clip = fixtures::person_clip();
  clip.end_sites = {{12, {0, 0.2, 0}}};
  write_motion(folder / "walk.npz", clip);
  const MotionClip back = read_motion(folder / "walk.npz");
  EXPECT_EQ(back.motion.fps, clip.motion.fps);
  EXPECT_EQ(back.motion.frame_ids, clip.motion.frame_ids);
  EXPECT_EQ(back.end_sites[0].offset, clip.end_sites[0].offset);
  EXPECT_EQ(back.motion.poses[3].rotations, clip.motion.poses[3].rotations);
  EXPECT_EQ(back.motion.poses[3].root_translation, clip.motion.poses[3].root_translation);
}

TEST(BodyArchive, OtherUnitsAndAxes_AreRefused) {
  const std::pair<const char*, const char*> frames[] = {{"unit", "cm"}, {"up", "z"}};
  for (const auto& [name, word] : frames) {
    const std::string said = std::string("array '") + name + "': '" + word + "'; expected";
    Arrays body = body_arrays(whole_body());
    body[name].strings[0] = word;
    EXPECT_THAT([&] { body_of_arrays(Npz(npz_bytes(body), "b.npz")); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(said), HasSubstr("metres, Y up"))));
    Arrays motion = motion_arrays(fixtures::person_clip());
    motion[name].strings[0] = word;
    EXPECT_THAT([&] { motion_of_arrays(Npz(npz_bytes(motion), "m.npz")); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(said), HasSubstr("metres, Y up"))));
    motion.erase(name);
    EXPECT_THAT([&] { motion_of_arrays(Npz(npz_bytes(motion), "m.npz")); },
                ThrowsMessage<DataError>(HasSubstr("missing")));
  }
}

TEST(BodyArchive, NumbersBeyondTheLimit_AreRefused) {
  for (const char* name : {"vertices", "offsets", "shape_joints"}) {
    Arrays arrays = body_arrays(whole_body());
    Tensor& tensor = arrays.at(name);
    const double huge = -1e300;
    std::memcpy(tensor.data.data() + sizeof huge, &huge, sizeof huge);
    EXPECT_THAT([&] { body_of_arrays(Npz(npz_bytes(arrays), "b.npz")); },
                ThrowsMessage<DataError>(
                    HasSubstr(std::string(name) + "[1]: -1e+300; expected at most 1e+09")));
  }
  Arrays arrays = motion_arrays(fixtures::person_clip());
  const double far = 2e9;
  std::memcpy(arrays.at("root_translation").data.data(), &far, sizeof far);
  const auto read = [&](const Limits& limits) {
    return motion_of_arrays(Npz(npz_bytes(arrays), "m.npz"), limits);
  };
  EXPECT_THAT([&] { read({}); }, ThrowsMessage<DataError>(HasSubstr("at most 1e+09")));
  Limits wide;
  wide.mesh_coordinate = 1e10;
  EXPECT_EQ(read(wide).motion.poses[0].root_translation.x(), far);
}

TEST(BodyArchive, InconsistentBodies_AreRefused) {
  const auto refused = [](void (*spoil)(Arrays&), const char* where) {
    Arrays arrays = body_arrays(whole_body());
    spoil(arrays);
    EXPECT_THAT([&] { body_of_arrays(Npz(npz_bytes(arrays), "b.npz")); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("b.npz"), HasSubstr(where))));
  };
  refused([](Arrays& a) { a.erase("schema"); }, "'atelier-body-1'");
  refused([](Arrays& a) { a["schema"].strings[0] = "atelier-body-9"; }, "'atelier-body-9'");
  for (const char* name :
       {"joint_names", "parents", "offsets", "vertices", "faces", "skin_joints", "skin_weights",
        "shape_names", "shape_ranges", "shape_starts", "corrective_features", "group_starts"}) {
    Arrays arrays = body_arrays(whole_body());
    arrays.erase(name);
    EXPECT_THAT([&] { body_of_arrays(Npz(npz_bytes(arrays), "b.npz")); },
                ThrowsMessage<DataError>(
                    AllOf(HasSubstr("array '" + std::string(name) + "'"), HasSubstr("missing"))));
  }
  refused(
      [](Arrays& a) {
        a["shape_starts"] = tensor_of<int>(std::vector<int>{0, 50, 44}, {3});
      },
      "'shape_starts'");
  refused(
      [](Arrays& a) {
        a["shape_starts"] = tensor_of<int>(std::vector<int>{0, 44}, {2});
      },
      "3 increasing ones from 0 to 44");
  refused(
      [](Arrays& a) {
        a["skin_joints"] = tensor_of<int>(std::vector<int>{0, 1}, {2});
      },
      "'skin_joints'");
  refused(
      [](Arrays& a) {
        std::vector<double> vertices(120, 0);
        vertices[7] = NAN;
        a["vertices"] = tensor_of<double>(vertices, {40, 3});
      },
      "vertices");
  refused([](Arrays& a) { a["parents"] = tensor_of<int>(std::vector<int>(7, 0), {7}); }, "joint 0");
  refused(
      [](Arrays& a) {
        a["faces"] = tensor_of<int>(std::vector<int>{0, 1, 40}, {1, 3});
      },
      "index 40");
  refused(
      [](Arrays& a) {
        a["parents"] = tensor_of<std::int64_t>(std::vector<std::int64_t>{1LL << 40}, {1});
      },
      "numbers of 32 bits");
}

TEST(BodyArchive, InconsistentMotions_AreRefused) {
  const auto refused = [](void (*spoil)(Arrays&), const char* where) {
    Arrays arrays = motion_arrays(fixtures::person_clip());
    spoil(arrays);
    EXPECT_THAT([&] { motion_of_arrays(Npz(npz_bytes(arrays), "m.npz")); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("m.npz"), HasSubstr(where))));
  };
  refused([](Arrays& a) { a["schema"].strings[0] = "atelier-body-1"; }, "'atelier-motion-1'");
  refused([](Arrays& a) { a.erase("rotations"); }, "'rotations'");
  refused([](Arrays& a) { a["fps"] = tensor_of<double>(std::vector<double>{0}, {}); },
          "frame rate");
  refused([](Arrays& a) { a["fps"] = tensor_of<double>(std::vector<double>{1, 2}, {2}); }, "one");
  refused(
      [](Arrays& a) {
        a["frame_ids"] = tensor_of<int>(std::vector<int>{0, 1}, {2});
      },
      "frame ids");
  refused(
      [](Arrays& a) {
        a["root_translation"] = tensor_of<double>(std::vector<double>(6), {2, 3});
      },
      "2 frames of 63");
}

TEST(BodyArchive, NamesOfJoints_AreTextInNumpy) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no NumPy (package python3-numpy)";
  }
  const fixtures::TemporaryDirectory folder;
  write_motion(folder / "a.npz", fixtures::person_clip());
  const fixtures::ChildResult found =
      fixtures::run_child({"/usr/bin/python3", "-c",
                           "import numpy, sys; names = numpy.load(sys.argv[1])['joint_names']; "
                           "print(names.dtype.kind, list(names).index('" +
                               fixtures::person_clip().skeleton.names[3] + "'))",
                           (folder / "a.npz").string()});
  EXPECT_EQ(found.out, "U 3\n") << found.err;
}

}  // namespace
}  // namespace atelier
