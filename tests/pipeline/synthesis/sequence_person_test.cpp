// The person in others' sequences of bodies: joints and keypoints by the names and the topology of
// the rigs that people have, in any pose and turned any way.
#include "pipeline/synthesis/sequence_person.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "capture/keypoint_schema.h"
#include "pipeline/synthesis/synthetic_subject.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A body in two frames, both turned about the vertical; in the second its knees and elbows are
/// bent.
struct Played {
  MeshSequenceFile file;
  std::vector<std::string> names;  ///< of the true keypoints
  std::vector<Points> keypoints;   ///< [F]
};

Played played(const BodyModel& model, double turn) {
  Played played;
  const Humanoid who = recognised_humanoid(model.skeleton);
  const SubjectKeypoints places = subject_keypoints(model);
  played.names = places.names;
  const ShapedBody shaped = shape_body(model);
  auto frames = std::make_shared<std::vector<Points>>();
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (const double bend : {0.0, 0.7}) {
    Pose pose = rest_pose(model.skeleton);
    for (const Leg& leg : who.legs) {
      pose.rotations.row(leg.knee) << bend, 0, 0;
    }
    for (const Arm& arm : who.arms) {
      pose.rotations.row(arm.elbow) << -bend, 0, 0;
    }
    frames->push_back(skin_vertices(model, shaped, pose) * rotation.transpose());
    played.file.joints.push_back(forward_kinematics(model.skeleton, pose).positions *
                                 rotation.transpose());
    played.keypoints.push_back(posed_points(model, places.places, pose) * rotation.transpose());
  }
  played.file.shared.faces = model.mesh.faces;
  played.file.shared.vertices = frames->front();
  played.file.names = model.skeleton.names;
  played.file.parents = model.skeleton.parents;
  played.file.sequence.frame_ids = {0, 1};
  played.file.sequence.faces = model.mesh.faces;
  played.file.sequence.load = [frames, faces = model.mesh.faces](Index i) {
    Mesh mesh;
    mesh.vertices = (*frames)[static_cast<std::size_t>(i)];
    mesh.faces = faces;
    return mesh;
  };
  return played;
}

const BodyModel& human() {
  static const BodyModel model = [] {
    DefaultHumanOptions options;
    options.shape_basis = false;
    return default_human(options);
  }();
  return model;
}

/// How far the keypoints of BODY_25 are off in both frames: at most at joints, and elsewhere.
struct Off {
  double joints = 0;
  double surface = 0;
  std::size_t missing = 0;
};

Off off_of(const Played& played, const SequencePerson& person) {
  Off off;
  for (const std::string& name : body_25_schema().points) {
    const auto found = std::find_if(person.keypoints.begin(), person.keypoints.end(),
                                    [&](const SequenceKeypoint& k) { return k.name == name; });
    if (found == person.keypoints.end()) {
      ++off.missing;
      continue;
    }
    const auto row = static_cast<Index>(std::find(played.names.begin(), played.names.end(), name) -
                                        played.names.begin());
    for (std::size_t f = 0; f < 2; ++f) {
      const Points points = person_keypoints(
          person, played.file.joints[f],
          frame(played.file.sequence, static_cast<Index>(f)).vertices, played.file.shared.faces);
      const double gap =
          (points.row(found - person.keypoints.begin()) - played.keypoints[f].row(row)).norm();
      (found->face < 0 ? off.joints : off.surface) =
          std::max(found->face < 0 ? off.joints : off.surface, gap);
    }
  }
  return off;
}

/// The default human's joints under the names of another family, by SMPL's names.
using Family = std::function<std::string(const std::string& side, const std::string& joint)>;

std::string from_table(const std::map<std::string, std::string>& table, const std::string& joint) {
  const auto found = table.find(joint);
  return found == table.end() ? "extra_" + joint : found->second;
}

std::string cmu(const std::string& side, const std::string& joint) {
  const std::string s = side == "left" ? "Left" : "Right";
  return from_table({{"pelvis", "Hips"},
                     {"hip", s + "UpLeg"},
                     {"knee", s + "Leg"},
                     {"ankle", s + "Foot"},
                     {"foot", s + "ToeBase"},
                     {"neck", "Neck"},
                     {"head", "Head"},
                     {"collar", s + "Shoulder"},
                     {"shoulder", s + "Arm"},
                     {"elbow", s + "ForeArm"},
                     {"wrist", s + "Hand"}},
                    joint);
}

std::string mixamo(const std::string& side, const std::string& joint) {
  return "mixamorig:" + cmu(side, joint);
}

std::string makehuman(const std::string& side, const std::string& joint) {
  const std::string s = side == "left" ? ".L" : ".R";
  return from_table({{"pelvis", "root"},
                     {"hip", "upperleg01" + s},
                     {"knee", "lowerleg01" + s},
                     {"ankle", "foot" + s},
                     {"neck", "neck01"},
                     {"head", "head"},
                     {"collar", "clavicle" + s},
                     {"shoulder", "upperarm01" + s},
                     {"elbow", "lowerarm01" + s},
                     {"wrist", "wrist" + s}},
                    joint);
}

std::string mhr(const std::string& side, const std::string& joint) {
  const std::string s = side == "left" ? "l_" : "r_";
  return from_table({{"pelvis", "b_root"},
                     {"hip", s + "upleg"},
                     {"knee", s + "lowleg"},
                     {"ankle", s + "foot"},
                     {"foot", s + "ball"},
                     {"neck", "c_neck"},
                     {"head", "c_head"},
                     {"collar", s + "clavicle"},
                     {"shoulder", s + "uparm"},
                     {"elbow", s + "lowarm"},
                     {"wrist", s + "wrist"}},
                    joint);
}

std::string smpl(const std::string& side, const std::string& joint) {
  return side.empty() ? joint : side + "_" + joint;
}

/// With joints of a family's names; others are called by what says nothing.
Played renamed(Played one, const Family& family) {
  const Skeleton named = with_smpl_names(human().skeleton, recognised_humanoid(human().skeleton));
  for (std::size_t j = 0; j < named.names.size(); ++j) {
    const std::string& name = named.names[j];
    const std::size_t cut = name.find('_');
    const std::string side = name.substr(0, cut);
    const bool sided = side == "left" || side == "right";
    const std::string joint = sided ? name.substr(cut + 1) : name;
    const std::string given = family(sided ? side : "", joint);
    one.file.names[j] = given.find("extra_") == 0 ? "extra_" + std::to_string(j) : given;
  }
  return one;
}

class SequencePersonFamily : public ::testing::TestWithParam<std::pair<const char*, Family>> {};

TEST_P(SequencePersonFamily, Keypoints_AreWhereTheSubjectHasThem) {
  const Played one = renamed(played(human(), 2.3), GetParam().second);
  const SequencePerson person = sequence_person(one.file);
  EXPECT_EQ(person.problem, "");
  EXPECT_EQ(person.skeleton.names.size(), one.file.names.size());
  const Off off = off_of(one, person);
  EXPECT_EQ(off.missing, 0U);
  EXPECT_LT(off.joints, 1e-9);
  EXPECT_LT(off.surface, 0.03);  // toes and face, by the nearest bone and not by skin weights
  EXPECT_TRUE(find_humanoid(person.skeleton).has_value());
}

INSTANTIATE_TEST_SUITE_P(
    Names, SequencePersonFamily,
    ::testing::ValuesIn(std::vector<std::pair<const char*, Family>>{
        {"cmu", cmu}, {"mixamo", mixamo}, {"makehuman", makehuman}, {"mhr", mhr}, {"smpl", smpl}}),
    [](const auto& one) { return std::string(one.param.first); });

TEST(SequencePerson, JointsWithoutParents_AreAPersonByNames) {
  Played one = renamed(played(human(), -1.1), smpl);
  one.file.parents.clear();
  const SequencePerson person = sequence_person(one.file);
  EXPECT_EQ(person.problem, "");
  const Off off = off_of(one, person);
  EXPECT_EQ(off.missing, 0U);
  EXPECT_LT(off.joints, 1e-9);
}

TEST(SequencePerson, ParentsInAnyOrder_AreSorted) {
  Played one = played(human(), 0.4);
  std::reverse(one.file.names.begin(), one.file.names.end());
  std::reverse(one.file.parents.begin(), one.file.parents.end());
  const auto last = static_cast<int>(one.file.names.size()) - 1;
  for (int& parent : one.file.parents) {
    parent = parent < 0 ? -1 : last - parent;
  }
  for (Points& joints : one.file.joints) {
    joints = joints.colwise().reverse().eval();
  }
  const SequencePerson person = sequence_person(one.file);
  EXPECT_EQ(person.problem, "");
  EXPECT_EQ(off_of(one, person).missing, 0U);
  EXPECT_LT(off_of(one, person).joints, 1e-9);
  const Points joints = person_joints(person, one.file.joints[1]);
  const int knee = recognised_humanoid(person.skeleton).legs[0].knee;
  const int true_knee = recognised_humanoid(human().skeleton).legs[0].knee;
  EXPECT_LT((joints.row(knee) - one.file.joints[1].row(last - true_knee)).norm(), 1e-12);
}

TEST(SequencePerson, NamelessJointsTurnedAway_AreAPersonByTopology) {
  for (const double turn : {0.0, 0.9, std::numbers::pi, -2.0}) {
    Played one = played(human(), turn);
    // A rig with fingers has no two chains of equal length alone: those of the body are kept.
    const Humanoid who = recognised_humanoid(human().skeleton);
    std::vector<int> kept = who.spine;
    kept.insert(kept.end(), who.neck.begin(), who.neck.end());
    for (std::size_t side = 0; side < 2; ++side) {
      const Leg& leg = who.legs[side];
      const Arm& arm = who.arms[side];
      for (const int joint : {leg.hip, leg.knee, leg.ankle, leg.toe, arm.collar, arm.shoulder,
                              arm.elbow, arm.wrist}) {
        if (joint >= 0) {
          kept.push_back(joint);
        }
      }
    }
    std::sort(kept.begin(), kept.end());
    MeshSequenceFile& file = one.file;
    std::vector<int> parents;
    for (const int joint : kept) {
      int parent = file.parents[static_cast<std::size_t>(joint)];
      auto at = kept.end();
      while (parent >= 0 && (at = std::find(kept.begin(), kept.end(), parent)) == kept.end()) {
        parent = file.parents[static_cast<std::size_t>(parent)];
      }
      parents.push_back(parent < 0 ? -1 : static_cast<int>(at - kept.begin()));
    }
    file.names.clear();
    for (std::size_t j = 0; j < kept.size(); ++j) {
      file.names.push_back("joint_" + std::to_string(j));
    }
    for (Points& joints : file.joints) {
      Points fewer(static_cast<Index>(kept.size()), 3);
      for (std::size_t j = 0; j < kept.size(); ++j) {
        fewer.row(static_cast<Index>(j)) = joints.row(kept[j]);
      }
      joints = fewer;
    }
    file.parents = parents;
    const SequencePerson person = sequence_person(file);
    EXPECT_EQ(person.problem, "") << turn;
    EXPECT_EQ(off_of(one, person).missing, 0U) << turn;
    EXPECT_LT(off_of(one, person).joints, 1e-9) << turn;  // left is left
    for (const std::string& line : sequence_person_lines(person, "coco_wholebody")) {
      EXPECT_THAT(line, testing::AnyOf(HasSubstr("93 of the 133"), HasSubstr("left_thumb_1")));
    }
  }
}

TEST(SequencePerson, JointsOfNoPerson_AreSaidToBeNone) {
  Played one = played(human(), 0);
  one.file.names = {"arm", "nose", "claw"};
  one.file.parents = {-1, 0, 1};
  for (Points& joints : one.file.joints) {
    joints = joints.topRows(3).eval();
  }
  const SequencePerson person = sequence_person(one.file);
  EXPECT_THAT(person.problem, HasSubstr("match no person by names or topology: arm, nose, claw"));
  EXPECT_THAT(person.skeleton.names, IsEmpty());
  ASSERT_EQ(person.keypoints.size(), 1U);  // by its own name
  EXPECT_EQ(person.keypoints[0].name, "nose");
  EXPECT_EQ(person_joints(person, one.file.joints[0]).rows(), 0);
  one.file.joints.clear();
  EXPECT_THAT(sequence_person(one.file).problem, HasSubstr("no joints"));
}

TEST(SequencePerson, ParentsInACircle_AreNoTree) {
  Played one = played(human(), 0);
  for (std::size_t j = 0; j < one.file.parents.size(); ++j) {
    one.file.parents[j] = static_cast<int>((j + 1) % one.file.parents.size());
  }
  EXPECT_NE(sequence_person(one.file).problem, "");
}

TEST(SequencePerson, ForeignSimulatorsFile_HasEveryKeypoint) {
  ATELIER_TEST_FILE(path, "other_simulator/sequence.npz");
  const MeshSequenceFile file = read_mesh_sequence(path, SequenceOf::Person);
  EXPECT_TRUE(file.shared.labels.empty());  // theirs count otherwise
  const SequencePerson person = sequence_person(file);
  EXPECT_EQ(person.problem, "");
  const Points vertices = frame(file.sequence, 0).vertices;
  const Points points = person_keypoints(person, file.joints.front(), vertices, file.shared.faces);
  const auto at = [&](const char* name) -> Eigen::RowVector3d {
    for (std::size_t k = 0; k < person.keypoints.size(); ++k) {
      if (person.keypoints[k].name == name) {
        return points.row(static_cast<Index>(k));
      }
    }
    ADD_FAILURE() << name;
    return {0, 0, 0};
  };
  for (const std::string& name : body_25_schema().points) {
    at(name.c_str());
  }
  EXPECT_GT((at("left_hip") - at("right_hip")).x(), 0.1);
  EXPECT_GT(at("nose").y(), at("neck").y() + 0.1);
  EXPECT_GT(at("nose").z(), at("left_ear").z());
  EXPECT_GT((at("left_ear") - at("right_ear")).norm(), 0.1);
  EXPECT_LT((at("left_ear") - at("right_ear")).norm(), 0.25);
  EXPECT_GT((at("left_big_toe") - at("left_heel")).norm(), 0.15);
  EXPECT_LT((at("left_big_toe") - at("left_heel")).norm(), 0.35);
}

TEST(SequencePerson, GltfBody_IsRecognised) {
  ATELIER_TEST_FILE(path, "gltf_skinned/mesh2motion/human-male.glb");
  const BodyModel model = read_body_file(path).model;
  const Played one = played(model, 1.3);
  const SequencePerson person = sequence_person(one.file);
  EXPECT_EQ(person.problem, "");
  EXPECT_EQ(off_of(one, person).missing, 0U);
  EXPECT_LT(off_of(one, person).joints, 1e-9);
}

TEST(SequencePerson, MakeHumanBody_IsRecognised) {
  ATELIER_TEST_FILE(path, "makehuman/base/base.obj");
  const BodyModel model = read_body_file(path).model;
  const Played one = played(model, -0.6);
  const SequencePerson person = sequence_person(one.file);
  EXPECT_EQ(person.problem, "");
  EXPECT_EQ(off_of(one, person).missing, 0U);
  EXPECT_LT(off_of(one, person).joints, 1e-9);
}

}  // namespace
}  // namespace atelier
