#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/intersection.h"

namespace atelier {
namespace {

DefaultHumanOptions without_basis(DefaultHumanOptions options) {
  options.shape_basis = false;
  return options;
}

Pose posed(const BodyModel& model, const std::string& joint, const Eigen::Vector3d& rotation) {
  Pose pose = rest_pose(model.skeleton);
  pose.rotations.row(find_joint(model.skeleton, joint)) = rotation.transpose();
  return pose;
}

Pose posed_at(const BodyModel& model, int joint, const Eigen::Vector3d& rotation) {
  Pose pose = rest_pose(model.skeleton);
  pose.rotations.row(joint) = rotation.transpose();
  return pose;
}

Pose t_pose(const BodyModel& model) {
  Pose pose = posed(model, "left_shoulder", Eigen::Vector3d(0, 0, M_PI / 4));
  pose.rotations.row(find_joint(model.skeleton, "right_shoulder")) << 0, 0, -M_PI / 4;
  return pose;
}

TEST(DefaultHumanShape, TallAndShortPeople_AreScaledNotDeformed) {
  for (const double male : {0.0, 0.5, 1.0}) {
    const BodyMeasurements average = measure_body(default_human({.male = male}));
    for (const double stature : {1.4, 1.5, 1.7, 1.9, 2.15}) {
      const BodyMeasurements body = measure_body(default_human({.male = male, .stature = stature}));
      EXPECT_NEAR(body.stature, stature, 0.005);
      const double ratio = body.calf_girth / body.thigh_girth;
      EXPECT_NEAR(ratio / (average.calf_girth / average.thigh_girth), 1, 0.1) << stature;
    }
  }
}

TEST(DefaultHumanShape, RandomHumans_HaveTheRequestedMeasures) {
  Random random{20, 1, 0};
  double worst = 0;
  for (int i = 0; i < 8; ++i) {
    const DefaultHumanOptions options = without_basis(random_human(random, i % 2));
    const BodyMeasurements asked = expected_measures(options);
    const BodyMeasurements found = measure_body(default_human(options));
    int compared = 0;
    for (const NamedMeasurement& name : measurement_names()) {
      if (asked.*name.value > 0) {
        EXPECT_NEAR(found.*name.value / (asked.*name.value), 1, 0.01) << name.name;
        worst = std::max(worst, std::abs(found.*name.value / (asked.*name.value) - 1));
        ++compared;
      }
    }
    EXPECT_EQ(compared, 12);
  }
  std::printf("largest error of a measure: %.4f%%\n", 100 * worst);
}

TEST(DefaultHumanShape, Presets_AreTheAveragesOfTheTables) {
  const BodyMeasurements woman = expected_measures(female_human());
  const BodyMeasurements man = expected_measures(male_human());
  EXPECT_DOUBLE_EQ(woman.stature, 1.63);
  EXPECT_DOUBLE_EQ(man.stature, 1.755);
  EXPECT_GT(man.shoulder_breadth / man.hip_girth, woman.shoulder_breadth / woman.hip_girth);
  EXPECT_LT(woman.waist_girth / woman.hip_girth, man.waist_girth / man.hip_girth);
}

TEST(DefaultHumanShape, UnsetMeasures_FollowStatureAndMass) {
  DefaultHumanOptions options = female_human();
  options.mass = 80;
  const BodyMeasurements heavy = expected_measures(options);
  const BodyMeasurements average = expected_measures(female_human());
  EXPECT_GT(heavy.waist_girth / average.waist_girth, heavy.neck_girth / average.neck_girth);
  EXPECT_DOUBLE_EQ(heavy.leg_length, average.leg_length);
}

void expect_no_crossing(const BodyModel& model, const std::string& body) {
  EXPECT_TRUE(self_intersections(model.mesh.vertices, model.mesh.faces).empty())
      << "A-pose, " << body;
  EXPECT_TRUE(self_intersections(skin_vertices(model, t_pose(model)), model.mesh.faces).empty())
      << "T-pose, " << body;
}

// Which bodies a test looks at: a sample or, in the long counts (scripts/soak body), all of them or
// those from ATELIER_SOAK_FIRST on.
struct Bodies {
  int first = 0;
  int end = 0;
};

Bodies bodies(int sampled, int soaked) {
  if (std::getenv("ATELIER_SOAK") == nullptr) {
    return {0, sampled};
  }
  const char* first = std::getenv("ATELIER_SOAK_FIRST");
  return {first == nullptr ? 0 : std::atoi(first), soaked};
}

// A long count that is cut off has said how far it came.
void say_progress(const char* what, const Bodies& range, int body) {
  if (std::getenv("ATELIER_SOAK") != nullptr) {
    std::printf("%s: %d looked at, from %d\n", what, body + 1 - range.first, range.first);
    std::fflush(stdout);
  }
}

TEST(DefaultHumanShape, NoSelfIntersectionOfRandomHumans_Occurs) {
  Random random{21, 1, 0};
  const Bodies range = bodies(12, 600);
  for (int i = 0; i < range.end; ++i) {
    const double male = i % 5 == 4 ? uniform(random, 0, 1) : i % 2;
    const DefaultHumanOptions human = random_human(random, male);
    if (i >= range.first) {
      expect_no_crossing(default_human(without_basis(human)), "random " + std::to_string(i));
      say_progress("random bodies", range, i);
    }
  }
  RecordProperty("bodies", range.end - range.first);
}

// All measures at the 5th percentile, all at the 95th, and corners where each is at the one or the
// other by a coin.
TEST(DefaultHumanShape, NoSelfIntersectionAtShapeSpaceCorners_Occurs) {
  Random random{22, 1, 0};
  const Bodies range = bodies(28, 600);
  for (int i = 0; i < range.end; ++i) {
    std::vector<double> percentiles(12, i < 2 ? 0.05 : 0.95);
    std::string body = i % 2 == 0 ? "woman" : "man";
    for (double& one : percentiles) {
      one = i >= 4 && uniform(random, 0, 1) < 0.5 ? 0.05 : one;
      body += one < 0.5 ? " low" : " high";
    }
    if (i >= range.first) {
      expect_no_crossing(default_human(without_basis(percentile_human(i % 2, percentiles))), body);
      say_progress("corners", range, i);
    }
  }
  RecordProperty("bodies", range.end - range.first);
}

// What crossed before the arm's root kept its distance from the flank: wide chests beside thick or
// short arms.
TEST(DefaultHumanShape, NoSelfIntersectionInArmpitsOfWideChests_Occurs) {
  const std::vector<double> corners[] = {
      {.95, .95, .95, .05, .05, .05, .05, .95, .95, .95, .05, .05},
      {.95, .95, .95, .95, .95, .05, .95, .95, .05, .95, .95, .95},
      {.95, .95, .05, .05, .05, .05, .05, .95, .95, .95, .95, .95},
      {.95, .95, .05, .95, .05, .05, .95, .95, .95, .95, .95, .05},
      {.95, .95, .05, .05, .95, .05, .05, .95, .05, .95, .95, .95}};
  for (const std::vector<double>& percentiles : corners) {
    expect_no_crossing(default_human(without_basis(percentile_human(1, percentiles))),
                       "man with a wide chest");
  }
}

// What crossed in T-pose while a raised arm pushed the top of the shoulder out by more: thick arms
// on narrow shoulders of short, heavy men.
TEST(DefaultHumanShape, NoSelfIntersectionOnNarrowShoulders_Occurs) {
  const std::vector<double> corners[] = {
      {.05, .95, .05, .95, .05, .05, .95, .05, .95, .05, .95, .95},
      {.05, .95, .95, .05, .05, .05, .95, .95, .95, .95, .95, .95}};
  for (const std::vector<double>& percentiles : corners) {
    expect_no_crossing(default_human(without_basis(percentile_human(1, percentiles))),
                       "man with narrow shoulders");
  }
}

TEST(DefaultHumanShape, LinearBasis_ChangesTheNamedMeasures) {
  const BodyModel model = default_human(female_human());
  EXPECT_EQ(model.shape.size(), 13u);
  // 1% of each parameter; the surface is not linear, so larger steps belong to the generator.
  for (const NamedMeasurement& name : measurement_names()) {
    const int index = find_shape(model, name.name);
    if (index < 0) {
      continue;
    }
    Eigen::VectorXd shape = neutral_shape(model);
    shape[index] *= 1.01;
    const BodyMeasurements found = measure_body(model, shape);
    for (const NamedMeasurement& other : measurement_names()) {
      const int at = find_shape(model, other.name);
      if (at >= 0) {
        EXPECT_NEAR(found.*other.value / shape[at], 1, 0.003)
            << name.name << " moved " << other.name;
      }
    }
  }
}

TEST(DefaultHumanShape, LinearBasis_HoldsOverTenPercent) {
  const BodyModel model = default_human(male_human());
  Eigen::VectorXd shape = neutral_shape(model);
  shape[find_shape(model, "stature")] += 0.08;
  shape[find_shape(model, "leg_length")] += 0.04;
  shape[find_shape(model, "torso_length")] += 0.03;
  shape[find_shape(model, "waist_girth")] += 0.06;
  shape[find_shape(model, "mass")] += 8;
  const BodyMeasurements found = measure_body(model, shape);
  EXPECT_NEAR(found.stature, shape[find_shape(model, "stature")], 0.01);
  EXPECT_NEAR(found.waist_girth / shape[find_shape(model, "waist_girth")], 1, 0.02);
}

// Signed volume of the piece of the skin round a joint, its openings closed by fans from their
// middles.
double piece_volume(const Points& v, const Triangles& f, const std::vector<char>& in) {
  std::map<std::pair<int, int>, int> edges;
  double volume = 0;
  for (Index i = 0; i < f.rows(); ++i) {
    if (in[i]) {
      const Eigen::Vector3d a = v.row(f(i, 0));
      const Eigen::Vector3d b = v.row(f(i, 1));
      const Eigen::Vector3d c = v.row(f(i, 2));
      volume += a.dot(b.cross(c)) / 6;
      for (int k = 0; k < 3; ++k) {
        edges[{f(i, k), f(i, (k + 1) % 3)}] = 1;
      }
    }
  }
  std::map<int, int> next;
  for (const auto& [edge, one] : edges) {
    if (edges.count({edge.second, edge.first}) == 0) {
      next[edge.second] = edge.first;
    }
  }
  while (!next.empty()) {
    std::vector<int> loop;
    for (int at = next.begin()->first; next.count(at);) {
      loop.push_back(at);
      const int to = next[at];
      next.erase(at);
      at = to;
    }
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int i : loop) {
      middle += v.row(i).transpose() / static_cast<double>(loop.size());
    }
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector3d a = v.row(loop[i]);
      const Eigen::Vector3d b = v.row(loop[(i + 1) % loop.size()]);
      volume += middle.dot(a.cross(b)) / 6;
    }
  }
  return volume;
}

struct Bend {
  const char* name;
  const char* joint;
  Eigen::Vector3d rotation;
  double radius;  // metres: about the limb's own thickness
};

// Both directions of every axis in which a joint bends, as far as its limits go.
TEST(DefaultHumanVolume, BendingToNinetyDegrees_KeepsTheVolume) {
  const double q = M_PI / 2;
  const double h = q * std::sqrt(0.5);
  const Bend bends[] = {{"knee flexion", "left_knee", {q, 0, 0}, 0.12},
                        {"hip flexion", "left_hip", {-q, 0, 0}, 0.16},
                        {"hip extension 30", "left_hip", {q / 3, 0, 0}, 0.16},
                        {"hip abduction 45", "left_hip", {0, 0, q / 2}, 0.16},
                        {"hip adduction 30", "left_hip", {0, 0, -q / 3}, 0.16},
                        {"elbow flexion", "left_elbow", {-h, -h, 0}, 0.08},
                        {"elbow the other way", "left_elbow", {h, h, 0}, 0.08},
                        {"elbow to the front", "left_elbow", {0, -q, 0}, 0.08},
                        {"elbow to the back", "left_elbow", {0, q, 0}, 0.08},
                        {"shoulder to the front", "left_shoulder", {-q, 0, 0}, 0.13},
                        {"shoulder to the back", "left_shoulder", {q, 0, 0}, 0.13},
                        {"shoulder across", "left_shoulder", {0, -q, 0}, 0.13},
                        {"shoulder across, back 60", "left_shoulder", {0, 2 * q / 3, 0}, 0.13},
                        {"shoulder up", "left_shoulder", {0, 0, q}, 0.13},
                        {"shoulder up 45", "left_shoulder", {0, 0, q / 2}, 0.13},
                        {"shoulder down 45", "left_shoulder", {0, 0, -q / 2}, 0.13}};
  for (bool male : {false, true}) {
    const BodyModel model = default_human(without_basis(male ? male_human() : female_human()));
    const Triangles& f = model.mesh.faces;
    const Points& rest = model.mesh.vertices;
    const Points joints = rest_positions(model.skeleton);
    for (const Bend& bend : bends) {
      const Eigen::RowVector3d centre = joints.row(find_joint(model.skeleton, bend.joint));
      std::vector<char> in(f.rows());
      for (Index i = 0; i < f.rows(); ++i) {
        in[i] = ((rest.row(f(i, 0)) + rest.row(f(i, 1)) + rest.row(f(i, 2))) / 3 - centre).norm() <
                bend.radius;
      }
      const double before = piece_volume(rest, f, in);
      const Pose pose = posed(model, bend.joint, bend.rotation);
      const double after = piece_volume(skin_vertices(model, pose), f, in) / before - 1;
      SkinOptions plain;
      plain.correctives = false;
      const double without =
          piece_volume(skin_vertices(model, pose, {}, plain), f, in) / before - 1;
      std::printf("%s, %s: %+.1f%% (without correctives %+.1f%%)\n", male ? "male" : "female",
                  bend.name, 100 * after, 100 * without);
      EXPECT_LT(std::abs(after), 0.08) << bend.name;
      EXPECT_LT(std::abs(after), std::abs(without) + 0.02) << bend.name;
    }
  }
}

TEST(DefaultHumanVolume, RestPose_HasNoCorrectives) {
  const BodyModel model = default_human(without_basis({}));
  const Points v = skin_vertices(model, rest_pose(model.skeleton));
  EXPECT_LT((v - model.mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

// Skin presses into skin at the ends of motion. How much: the share of the surface whose triangles
// cross others. The limits are what it is now, not what it should be.
TEST(DefaultHumanRig, TurnedHead_CarriesTheFaceRigidly) {
  const BodyModel model = default_human(without_basis({}));
  const int head = find_joint(model.skeleton, "head");
  const Eigen::RowVector3d joint = rest_positions(model.skeleton).row(head);
  const double stature = model.mesh.vertices.col(1).maxCoeff();
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0.7, 0), Eigen::Vector3d(0.5, 0, 0), Eigen::Vector3d(0, 0, 0.5)}) {
    const Points posed = skin_vertices(model, posed_at(model, head, turn));
    const Eigen::Matrix3d rotation =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    double worst = 0;
    int count = 0;
    for (Index v = 0; v < posed.rows(); ++v) {
      const Eigen::RowVector3d p = model.mesh.vertices.row(v);
      // Chin to brow, in front of the ears.
      if (p.y() > 0.872 * stature && p.z() > 0.04 * stature) {
        const Eigen::RowVector3d rigid = joint + (p - joint) * rotation.transpose();
        worst = std::max(worst, (posed.row(v) - rigid).norm());
        ++count;
      }
    }
    std::printf("face: %d vertices, at most %.1f mm off the head's turn\n", count, 1e3 * worst);
    EXPECT_GT(count, 300);
    EXPECT_LT(worst, 0.008);
  }
}

TEST(DefaultHumanFold, SelfIntersectionAtExtremePoses_StaysBelowKnownArea) {
  struct Extreme {
    const char* name;
    std::vector<std::pair<const char*, Eigen::Vector3d>> turns;
    double most;  // share of the surface
  };
  const double d = M_PI / 180;
  const double h = std::sqrt(0.5);
  const Extreme list[] = {
      {"elbow 90", {{"left_elbow", Eigen::Vector3d(-h, -h, 0) * 90 * d}}, 0.01},
      {"elbow 145", {{"left_elbow", Eigen::Vector3d(-h, -h, 0) * 145 * d}}, 0.03},
      {"knee 90", {{"left_knee", {90 * d, 0, 0}}}, 0.01},
      {"knee 140", {{"left_knee", {140 * d, 0, 0}}}, 0.05},
      {"hip 90", {{"left_hip", {-90 * d, 0, 0}}}, 0.02},
      {"hip 120", {{"left_hip", {-120 * d, 0, 0}}}, 0.05},
      {"sitting",
       {{"left_hip", {-90 * d, 0, 0}},
        {"right_hip", {-90 * d, 0, 0}},
        {"left_knee", {90 * d, 0, 0}},
        {"right_knee", {90 * d, 0, 0}}},
       0.04},
      {"squat",
       {{"left_hip", {-120 * d, 0, 0}},
        {"right_hip", {-120 * d, 0, 0}},
        {"left_knee", {140 * d, 0, 0}},
        {"right_knee", {140 * d, 0, 0}}},
       0.12},
      {"arm hanging", {{"left_shoulder", {0, 0, -40 * d}}}, 0.03},
      {"arm up", {{"left_collar", {0, 0, 20 * d}}, {"left_shoulder", {0, 0, 110 * d}}}, 0.02},
      {"arm across", {{"left_shoulder", {0, -130 * d, 0}}}, 0.03},
      {"fist",
       {{"left_index1", {0, 0, -90 * d}},
        {"left_index2", {0, 0, -90 * d}},
        {"left_middle1", {0, 0, -90 * d}},
        {"left_middle2", {0, 0, -90 * d}},
        {"left_ring1", {0, 0, -90 * d}},
        {"left_ring2", {0, 0, -90 * d}},
        {"left_pinky1", {0, 0, -90 * d}},
        {"left_pinky2", {0, 0, -90 * d}}},
       0.03}};
  const BodyModel woman = default_human(without_basis(female_human()));
  const BodyModel man = default_human(without_basis(male_human()));
  bool male = false;
  for (const Extreme& extreme : list) {
    male = !male;  // in turn: the differences are small
    const BodyModel& model = male ? man : woman;
    const Triangles& faces = model.mesh.faces;
    Pose pose = rest_pose(model.skeleton);
    for (const auto& [joint, turn] : extreme.turns) {
      pose.rotations.row(find_joint(model.skeleton, joint)) = turn.transpose();
    }
    const Points vertices = skin_vertices(model, pose);
    std::set<int> crossed;
    for (const auto& pair : self_intersections(vertices, faces)) {
      crossed.insert({pair[0], pair[1]});
    }
    double area = 0;
    double all = 0;
    for (int f = 0; f < static_cast<int>(faces.rows()); ++f) {
      const Eigen::Vector3d a = vertices.row(faces(f, 0));
      const Eigen::Vector3d b = vertices.row(faces(f, 1));
      const Eigen::Vector3d c = vertices.row(faces(f, 2));
      const double one = (b - a).cross(c - a).norm() / 2;
      all += one;
      area += crossed.count(f) > 0 ? one : 0;
    }
    std::printf("%s, %s: %.2f%% of the surface crosses\n", male ? "male" : "female", extreme.name,
                100 * area / all);
    EXPECT_LT(area / all, extreme.most) << extreme.name;
  }
}

TEST(DefaultHumanAtlas, AtlasIslands_AreNamedUnmirroredAndFillTheSquare) {
  const BodyModel model = default_human(without_basis({}));
  const Mesh& mesh = model.mesh;
  ASSERT_EQ(mesh.uv_faces.rows(), mesh.faces.rows());
  EXPECT_GE(mesh.uvs.minCoeff(), 0);
  EXPECT_LE(mesh.uvs.maxCoeff(), 1);
  int islands = 0;
  for (const VertexGroup& group : model.groups) {
    islands += group.name.rfind("uv_", 0) == 0;
    EXPECT_FALSE(group.vertices.empty()) << group.name;
  }
  EXPECT_EQ(islands, 16);
  int flipped = 0;
  double area = 0;
  for (Index i = 0; i < mesh.uv_faces.rows(); ++i) {
    const Eigen::RowVector2d a = mesh.uvs.row(mesh.uv_faces(i, 0));
    const Eigen::RowVector2d b = mesh.uvs.row(mesh.uv_faces(i, 1)) - a;
    const Eigen::RowVector2d c = mesh.uvs.row(mesh.uv_faces(i, 2)) - a;
    const double twice = b.x() * c.y() - b.y() * c.x();
    flipped += twice <= 0;
    area += std::abs(twice) / 2;
  }
  std::printf("flipped %d of %d, area %.2f\n", flipped, static_cast<int>(mesh.uv_faces.rows()),
              area);
  EXPECT_EQ(flipped, 0);
  EXPECT_GT(area, 0.45);
}

// No texel's centre is inside triangles of two islands, and hardly any in two of one: the web of
// the thumb and the shoulder fold a little over the border of theirs.
TEST(DefaultHumanAtlas, AtlasIslands_DoNotOverlap) {
  const Mesh mesh = default_human(without_basis({})).mesh;
  constexpr int kSide = 2048;
  std::vector<int> owner(static_cast<std::size_t>(kSide) * kSide, -1);
  int between = 0;
  int within = 0;
  int filled = 0;
  // Islands: what hangs together by texture coordinates.
  std::vector<int> island(static_cast<std::size_t>(mesh.uvs.rows()));
  std::iota(island.begin(), island.end(), 0);
  const auto root = [&](int v) {
    while (island[static_cast<std::size_t>(v)] != v) {
      v = island[static_cast<std::size_t>(v)] =
          island[static_cast<std::size_t>(island[static_cast<std::size_t>(v)])];
    }
    return v;
  };
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    island[static_cast<std::size_t>(root(mesh.uv_faces(f, 0)))] = root(mesh.uv_faces(f, 1));
    island[static_cast<std::size_t>(root(mesh.uv_faces(f, 1)))] = root(mesh.uv_faces(f, 2));
  }
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    Eigen::Matrix<double, 3, 2> p;
    for (int c = 0; c < 3; ++c) {
      p.row(c) = kSide * mesh.uvs.row(mesh.uv_faces(f, c));
    }
    const Eigen::RowVector2d low = p.colwise().minCoeff();
    const Eigen::RowVector2d high = p.colwise().maxCoeff();
    const auto side = [&](int c, const Eigen::RowVector2d& q) {
      const Eigen::RowVector2d a = p.row((c + 1) % 3) - p.row(c);
      const Eigen::RowVector2d b = q - p.row(c);
      return a.x() * b.y() - a.y() * b.x();
    };
    for (int y = std::max(0, static_cast<int>(low.y())); y < std::min(kSide + 0.0, high.y()); ++y) {
      for (int x = std::max(0, static_cast<int>(low.x())); x < std::min(kSide + 0.0, high.x());
           ++x) {
        const Eigen::RowVector2d q(x + 0.5, y + 0.5);
        if (side(0, q) > 1e-9 && side(1, q) > 1e-9 && side(2, q) > 1e-9) {
          int& one = owner[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)];
          const int here = root(mesh.uv_faces(f, 0));
          between += one >= 0 && one != here;
          within += one == here;
          filled += one < 0;
          one = here;
        }
      }
    }
  }
  std::printf("filled %.1f%%; texels in two islands %d, twice in one %d (%.4f%% of the filled)\n",
              100.0 * filled / kSide / kSide, between, within, 100.0 * within / filled);
  EXPECT_EQ(between, 0);
  EXPECT_LT(within, 3e-4 * filled);
}

TEST(DefaultHumanLimits, JointLimits_AllowTheRestPoseAndAreMirrored) {
  const BodyModel model = default_human(without_basis({}));
  const Skeleton& s = model.skeleton;
  EXPECT_LE(s.limits_min.maxCoeff(), 0);
  EXPECT_GE(s.limits_max.minCoeff(), 0);
  const int left = find_joint(s, "left_hip");
  const int right = find_joint(s, "right_hip");
  EXPECT_DOUBLE_EQ(s.limits_min(left, 0), s.limits_min(right, 0));
  EXPECT_DOUBLE_EQ(s.limits_min(left, 2), -s.limits_max(right, 2));
  const int knee = find_joint(s, "left_knee");
  EXPECT_EQ(s.limits_min(knee, 0), 0);
  EXPECT_NEAR(s.limits_max(knee, 0), 140 * M_PI / 180, 1e-12);
}

TEST(DefaultHumanRandom, RandomHumans_RepeatAndRangesAreRefused) {
  Random a{5, 2, 0};
  Random b{5, 2, 0};
  EXPECT_EQ(random_human(a, 0.3).waist_girth, random_human(b, 0.3).waist_girth);
  EXPECT_THROW(random_human(a, 2), LogicError);
  EXPECT_THROW(random_human(a, 0.5, 0.9, 0.1), LogicError);
  EXPECT_THROW(random_human(a, 0.5, 0, 0.5), LogicError);
  const std::vector<double> middle(12, 0.5);
  EXPECT_NEAR(percentile_human(0, middle).waist_girth,
              expected_measures(female_human()).waist_girth, 1e-9);
  EXPECT_THROW(percentile_human(2, middle), LogicError);
  EXPECT_THROW(percentile_human(0, {0.5, 0.5}), LogicError);
  EXPECT_THROW(percentile_human(0, std::vector<double>(12, 1.0)), LogicError);
}

}  // namespace
}  // namespace atelier
