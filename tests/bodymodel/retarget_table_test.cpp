// Every motion format on every kind of body, by way of files.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/human/human_anatomy.h"
#include "bodymodel/human/human_rig.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/io/npz.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::person_body;
using fixtures::person_clip;
using fixtures::person_skeleton;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

fs::path folder() {
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_retarget_table";
  fs::create_directories(path);
  return path;
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

fs::path bvh_file() {
  write_motion_file(folder() / "person.bvh", person_clip());
  return folder() / "person.bvh";
}

fs::path gltf_file() {
  const MotionClip clip = person_clip();
  write_gltf(folder() / "person_motion.glb",
             gltf_body(person_body(clip.skeleton), {}, clip.motion));
  return folder() / "person_motion.glb";
}

fs::path amass_file() {
  const MotionClip clip = person_clip();
  std::vector<double> poses(5 * 156, 0);
  std::vector<double> trans;
  for (std::size_t i = 0; i < 5; ++i) {
    double* row = poses.data() + 156 * i;
    row[0] = M_PI / 2;  // a person who stands along z and faces -y
    for (Index c = 0; c < 3; ++c) {
      row[3 * 16 + c] = clip.motion.poses[i].rotations(14, c);  // left shoulder
      row[3 * 5 + c] = clip.motion.poses[i].rotations(6, c);    // right knee
    }
    trans.insert(trans.end(), {0, -0.02 * static_cast<double>(i), 0.9});
  }
  const std::map<std::string, Tensor> arrays = {
      {"poses", tensor_of<double>(poses, {5, 156})},
      {"trans", tensor_of<double>(trans, {5, 3})},
      {"betas", tensor_of<double>(std::vector<double>(16, 0), {16})},
      {"mocap_framerate", tensor_of<double>(std::vector<double>{30}, {})}};
  const std::vector<std::byte> bytes = npz_bytes(arrays);
  std::ofstream(folder() / "person_poses.npz", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return folder() / "person_poses.npz";
}

// Acclaim's bones lead to a joint; the person's joint j ends the bone named here.
fs::path amc_file() {
  const MotionClip clip = person_clip();
  const Skeleton& skeleton = clip.skeleton;
  const char* bones[21] = {
      "root",     "lhipjoint", "lfemur",    "ltibia",    "lfoot",     "rhipjoint", "rfemur",
      "rtibia",   "rfoot",     "lowerback", "thorax",    "lowerneck", "upperneck", "lclavicle",
      "lcollar2", "lhumerus",  "lradius",   "rclavicle", "rcollar2",  "rhumerus",  "rradius"};
  std::string asf =
      ":version 1.10\n:name person\n:units\n  mass 1.0\n  length 1.0\n  angle deg\n:root\n"
      "   order TX TY TZ RX RY RZ\n   axis XYZ\n   position 0 0 0\n   orientation 0 0 0\n"
      ":bonedata\n";
  std::string hierarchy = ":hierarchy\n  begin\n";
  const auto bone = [&](const std::string& name, const Eigen::Vector3d& d, int id) {
    const Eigen::Vector3d n = d.normalized();
    char text[300];
    std::snprintf(text, sizeof text,
                  "  begin\n     id %d\n     name %s\n     direction %.9f %.9f %.9f\n"
                  "     length %.9f\n     axis 0 0 0 XYZ\n%s  end\n",
                  id, name.c_str(), n.x(), n.y(), n.z(), d.norm(),
                  name == "lhumerus" || name == "rtibia"
                      ? "    dof rx ry rz\n    limits (-180 180)\n           (-180 180)\n"
                        "           (-180 180)\n"
                      : "");
    asf += text;
  };
  for (std::size_t j = 1; j < 21; ++j) {
    bone(bones[j], skeleton.offsets.row(static_cast<Index>(j)), static_cast<int>(j));
    hierarchy += std::string("    ") + bones[skeleton.parents[j]] + " " + bones[j] + "\n";
  }
  // Bones that end in no joint.
  const std::pair<const char*, const char*> ends[] = {{"lfoot", "ltoes"},
                                                      {"rfoot", "rtoes"},
                                                      {"upperneck", "head"},
                                                      {"lradius", "lhand"},
                                                      {"rradius", "rhand"}};
  int id = 21;
  for (const auto& [parent, name] : ends) {
    bone(name, {0, std::string(name) == "head" ? 0.15 : 0, 0.06}, id++);
    hierarchy += std::string("    ") + parent + " " + name + "\n";
  }
  write(folder() / "person.asf", asf + hierarchy + "  end\n");
  // The rotation of the joint at a bone's beginning: hip and knee, shoulder and elbow.
  std::string amc = "#!OML:ASF person\n:FULLY-SPECIFIED\n:DEGREES\n";
  const auto angles = [](const Eigen::Vector3d& r) {
    // R = Rz Ry Rx
    const Eigen::Matrix3d m = rotation_matrix(r);
    const double y = std::asin(-m(2, 0));
    const double x = std::atan2(m(2, 1), m(2, 2));
    const double z = std::atan2(m(1, 0), m(0, 0));
    char text[120];
    std::snprintf(text, sizeof text, " %.9f %.9f %.9f", x * 180 / M_PI, y * 180 / M_PI,
                  z * 180 / M_PI);
    return std::string(text);
  };
  for (std::size_t i = 0; i < 5; ++i) {
    const Pose& pose = clip.motion.poses[i];
    char root[120];
    std::snprintf(root, sizeof root, "%zu\nroot 0 0.97 %.9f 0 0 0\n", i + 1,
                  pose.root_translation.z());
    amc += root;
    amc += "lhumerus" + angles(pose.rotations.row(14)) + "\n";
    amc += "rtibia" + angles(pose.rotations.row(6)) + "\n";
  }
  write(folder() / "person.amc", amc);
  return folder() / "person.amc";
}

fs::path trc_file() {
  const MotionClip person = person_clip();
  const std::pair<const char*, int> markers[] = {
      {"LHip", 1},       {"LKnee", 2},   {"LAnkle", 3},     {"RHip", 5},    {"RKnee", 6},
      {"RAnkle", 7},     {"Neck", 11},   {"LShoulder", 14}, {"LElbow", 15}, {"LWrist", 16},
      {"RShoulder", 18}, {"RElbow", 19}, {"RWrist", 20}};
  MarkerClip clip;
  clip.fps = 30;
  for (const auto& [name, joint] : markers) {
    clip.markers.emplace_back(name);
  }
  for (std::size_t i = 0; i < person.motion.poses.size(); ++i) {
    const Points joints = forward_kinematics(person.skeleton, person.motion.poses[i]).positions;
    Points at(13, 3);
    for (Index m = 0; m < 13; ++m) {
      at.row(m) = joints.row(markers[m].second);
    }
    clip.frame_ids.push_back(static_cast<int>(i));
    clip.positions.push_back(at);
    clip.seen.emplace_back(13, true);
  }
  write(folder() / "person.trc", fixtures::trc_text(clip, "mm", 1000));
  return folder() / "person.trc";
}

// A file of SMPL's layout: 24 joints in T-pose, four vertices round each.
fs::path smpl_file() {
  const Skeleton human = human_skeleton(human_anatomy({}));
  Pose pose = rest_pose(human);
  pose.rotations(find_joint(human, "left_shoulder"), 2) = M_PI / 4;
  pose.rotations(find_joint(human, "right_shoulder"), 2) = -M_PI / 4;
  Points joints = forward_kinematics(human, pose).positions.topRows(24);
  joints.row(22) = joints.row(20) + Eigen::RowVector3d(0.08, 0, 0);
  joints.row(23) = joints.row(21) - Eigen::RowVector3d(0.08, 0, 0);
  const double r = 0.02;
  const double corners[4][3] = {{r, r, r}, {r, -r, -r}, {-r, r, -r}, {-r, -r, r}};
  std::vector<float> vertices, regressor(24 * 96, 0), weights(96 * 24, 0);
  std::vector<std::uint32_t> faces, tree;
  for (std::size_t j = 0; j < 24; ++j) {
    const std::uint32_t v = static_cast<std::uint32_t>(4 * j);
    for (std::size_t c = 0; c < 4; ++c) {
      for (std::size_t i = 0; i < 3; ++i) {
        vertices.push_back(static_cast<float>(joints(j, i) + corners[c][i]));
      }
      regressor[j * 96 + 4 * j + c] = 0.25F;
      weights[(4 * j + c) * 24 + j] = 1;
    }
    faces.insert(faces.end(),
                 {v, v + 1, v + 2, v, v + 2, v + 3, v, v + 3, v + 1, v + 1, v + 3, v + 2});
  }
  const int parents[24] = {-1, 0, 0, 0,  1,  2,  3,  4,  5,  6,  7,  8,
                           9,  9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21};
  for (const int parent : parents) {
    tree.push_back(parent < 0 ? 4'294'967'295U : static_cast<std::uint32_t>(parent));
  }
  for (std::uint32_t j = 0; j < 24; ++j) {
    tree.push_back(j);
  }
  const std::map<std::string, Tensor> arrays = {
      {"v_template", tensor_of<float>(vertices, {96, 3})},
      {"f", tensor_of<std::uint32_t>(faces, {96, 3})},
      {"shapedirs", tensor_of<float>(std::vector<float>(96 * 3 * 10, 0), {96, 3, 10})},
      {"posedirs", tensor_of<float>(std::vector<float>(96 * 3 * 207, 0), {96, 3, 207})},
      {"J_regressor", tensor_of<float>(regressor, {24, 96})},
      {"weights", tensor_of<float>(weights, {96, 24})},
      {"kintree_table", tensor_of<std::uint32_t>(tree, {2, 24})}};
  const std::vector<std::byte> bytes = npz_bytes(arrays);
  std::ofstream(folder() / "smpl.npz", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return folder() / "smpl.npz";
}

fs::path gltf_body_file() {
  write_gltf(folder() / "person_body.glb", gltf_body(person_body(person_skeleton())));
  return folder() / "person_body.glb";
}

// Directions of thighs, shins, upper arms and forearms.
std::vector<Eigen::Vector3d> limbs(const Skeleton& skeleton, const Pose& pose) {
  const Humanoid person = recognised_humanoid(skeleton);
  const Points joints = forward_kinematics(skeleton, pose).positions;
  std::vector<Eigen::Vector3d> directions;
  const auto add = [&](int from, int to) {
    directions.emplace_back((joints.row(to) - joints.row(from)).normalized());
  };
  for (std::size_t side = 0; side < 2; ++side) {
    add(person.legs[side].hip, person.legs[side].knee);
    add(person.legs[side].knee, person.legs[side].ankle);
    add(person.arms[side].shoulder, person.arms[side].elbow);
    add(person.arms[side].elbow, person.arms[side].wrist);
  }
  return directions;
}

TEST(RetargetTable, EveryFormat_MovesEveryBody) {
  const std::pair<const char*, fs::path> motions[] = {{"BVH", bvh_file()},
                                                      {"AMASS", amass_file()},
                                                      {"AMC/ASF", amc_file()},
                                                      {"TRC", trc_file()},
                                                      {"glTF", gltf_file()}};
  std::vector<std::pair<std::string, BodyModel>> bodies;
  DefaultHumanOptions plain = female_human();
  plain.shape_basis = false;
  bodies.emplace_back("default human", default_human(plain));
  const fs::path base = fixtures::test_data_root() / "makehuman/base/base.obj";
  if (fs::exists(base)) {
    bodies.emplace_back("MakeHuman", read_body_file(base).model);
  }
  bodies.emplace_back("glTF body", read_body_file(gltf_body_file()).model);
  bodies.emplace_back("SMPL npz", read_body_file(smpl_file()).model);

  const MotionClip truth = person_clip();
  const std::vector<Eigen::Vector3d> asked = limbs(truth.skeleton, truth.motion.poses[4]);
  RetargetOptions options;
  options.keep_contacts = false;
  options.drop_t_pose = false;
  std::printf("largest angle between a limb and the recorded one, degrees\n");
  for (const auto& [body, model] : bodies) {
    std::printf("  %-14s", body.c_str());
    for (const auto& [format, file] : motions) {
      SCOPED_TRACE(body + " moved by " + format);
      const MotionClip clip = read_motion_file(file);
      const Retargeted moved = retarget(clip, model, {}, options);
      ASSERT_EQ(moved.motion.poses.size(), 5u);
      const std::vector<Eigen::Vector3d> found = limbs(model.skeleton, moved.motion.poses[4]);
      double worst = 0;
      for (std::size_t i = 0; i < asked.size(); ++i) {
        worst = std::max(worst, std::acos(std::clamp(found[i].dot(asked[i]), -1.0, 1.0)));
      }
      std::printf("  %s %.1f", format, worst * 180 / M_PI);
      EXPECT_LT(worst, 0.2);
      const Points posed = skin_vertices(model, moved.motion.poses[4]);
      EXPECT_NEAR(posed.col(1).minCoeff(), 0, 0.03);
      EXPECT_LT(posed.col(1).maxCoeff(), 2.1);
      const Eigen::Vector3d step =
          moved.motion.poses[4].root_translation - moved.motion.poses[0].root_translation;
      EXPECT_NEAR(step.z(), moved.scale * 0.08, 0.03);
    }
    std::printf("\n");
  }
}

TEST(RetargetTable, NonHumanMotion_IsRefusedInEveryFormat) {
  MotionClip fox = person_clip();
  for (std::size_t j = 0; j < fox.skeleton.names.size(); ++j) {
    fox.skeleton.names[j] = "b" + std::to_string(j);
    fox.skeleton.parents[j] = static_cast<int>(j) - 1;  // one long tail
  }
  DefaultHumanOptions plain;
  plain.shape_basis = false;
  const BodyModel human = default_human(plain);
  const fs::path bvh = folder() / "fox.bvh";
  write_motion_file(bvh, fox);
  EXPECT_THAT([&] { retarget(read_motion_file(bvh), human); },
              ThrowsMessage<DataError>(HasSubstr("joints that match no person: b0, b1")));
  const fs::path glb = folder() / "fox.glb";
  write_gltf(glb, gltf_body(person_body(fox.skeleton), {}, fox.motion));
  EXPECT_THAT([&] { retarget(read_motion_file(glb), human); },
              ThrowsMessage<DataError>(HasSubstr("joints that match no person")));
  write(folder() / "table.trc",
        "PathFileType\t4\t(X/Y/Z)\tt.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
        "60\t60\t1\t2\tmm\nFrame#\tTime\tleg1\t\t\tleg2\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
        "1\t0\t1\t2\t3\t4\t5\t6\n");
  EXPECT_THAT([&] { read_motion_file(folder() / "table.trc"); },
              ThrowsMessage<DataError>(HasSubstr("0 of 2 that mean a place on a person")));
}

}  // namespace
}  // namespace atelier
