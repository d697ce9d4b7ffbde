#include <array>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/human/default_human.h"
#include "core/error.h"
#include "core/topology.h"

namespace atelier {
namespace {

BodyModel plain_human(double male) {
  DefaultHumanOptions options;
  options.male = male;
  options.shape_basis = false;
  options.correctives = false;
  return default_human(options);
}

// Left vertices follow the middle ones, right ones follow in the same order.
std::vector<int> mirror_map(const BodyModel& model) {
  const Points& v = model.mesh.vertices;
  int middle = 0;
  while (v(middle, 0) == 0) {
    ++middle;
  }
  const int side = (static_cast<int>(v.rows()) - middle) / 2;
  std::vector<int> mirror(static_cast<std::size_t>(v.rows()));
  for (int i = 0; i < static_cast<int>(v.rows()); ++i) {
    mirror[i] = i < middle ? i : i < middle + side ? i + side : i - side;
  }
  return mirror;
}

TEST(DefaultHumanTopology, DefaultHuman_IsOneClosedManifoldOfGenusZero) {
  for (double male : {0.0, 1.0}) {
    const BodyModel model = plain_human(male);
    EXPECT_NO_THROW(check_body_model(model));
    const Topology topology = topology_of(model.mesh.faces, vertex_count(model));
    EXPECT_TRUE(is_manifold(manifold_defects(topology)));
    EXPECT_TRUE(manifold_defects(topology).isolated_vertices.empty());
    EXPECT_TRUE(is_closed(topology));
    EXPECT_EQ(connected_components(topology).count, 1);
    EXPECT_EQ(euler_characteristic(topology), 2);
    EXPECT_GT(vertex_count(model), 9000);
    EXPECT_LT(vertex_count(model), 14000);
  }
}

TEST(DefaultHumanTopology, Surface_IsOrientedOutwards) {
  const BodyModel model = plain_human(0.5);
  EXPECT_GT(mesh_volume(model.mesh.vertices, model.mesh.faces), 0.04);
}

TEST(DefaultHumanTopology, LeftSide_MirrorsTheRightExactly) {
  const BodyModel model = plain_human(0);
  const std::vector<int> mirror = mirror_map(model);
  const Points& v = model.mesh.vertices;
  for (Index i = 0; i < v.rows(); ++i) {
    const Index m = mirror[i];
    EXPECT_EQ(v(i, 0), -v(m, 0));
    EXPECT_EQ(v(i, 1), v(m, 1));
    EXPECT_EQ(v(i, 2), v(m, 2));
  }
  // The mirrored triangles are the triangles.
  std::set<std::array<int, 3>> triangles;
  const auto rotated = [](std::array<int, 3> t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  const Triangles& f = model.mesh.faces;
  for (Index i = 0; i < f.rows(); ++i) {
    triangles.insert(rotated({f(i, 0), f(i, 1), f(i, 2)}));
  }
  for (Index i = 0; i < f.rows(); ++i) {
    EXPECT_TRUE(triangles.count(rotated({mirror[f(i, 0)], mirror[f(i, 2)], mirror[f(i, 1)]})));
  }
}

TEST(DefaultHumanTopology, Triangles_AreWellShaped) {
  const BodyModel model = plain_human(1);
  const Points& v = model.mesh.vertices;
  const Triangles& f = model.mesh.faces;
  int slender = 0;
  double worst = 180;
  for (Index i = 0; i < f.rows(); ++i) {
    double smallest = 180;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d a = (v.row(f(i, (c + 1) % 3)) - v.row(f(i, c))).normalized();
      const Eigen::Vector3d b = (v.row(f(i, (c + 2) % 3)) - v.row(f(i, c))).normalized();
      smallest = std::min(smallest, std::acos(std::clamp(a.dot(b), -1.0, 1.0)) * 180 / M_PI);
    }
    slender += smallest < 30;
    worst = std::min(worst, smallest);
  }
  // Edges of one vertex: the longest over the shortest.
  const Index count = v.rows();
  std::vector<double> shortest(static_cast<std::size_t>(count), 1e9);
  std::vector<double> longest(static_cast<std::size_t>(count), 0);
  for (Index i = 0; i < f.rows(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double length = (v.row(f(i, (c + 1) % 3)) - v.row(f(i, c))).norm();
      for (const int at : {f(i, c), f(i, (c + 1) % 3)}) {
        shortest[at] = std::min(shortest[at], length);
        longest[at] = std::max(longest[at], length);
      }
    }
  }
  std::vector<double> spread;
  for (std::size_t i = 0; i < shortest.size(); ++i) {
    spread.push_back(longest[i] / shortest[i]);
  }
  std::sort(spread.begin(), spread.end());
  std::printf(
      "longest over shortest edge of a vertex: median %.2f, 95%% %.2f, most %.2f; "
      "smallest angle %.1f degrees, %.1f%% of triangles below 30\n",
      spread[spread.size() / 2], spread[spread.size() * 95 / 100], spread.back(), worst,
      100.0 * slender / static_cast<double>(f.rows()));
  EXPECT_LT(spread[spread.size() / 2], 1.6);
  EXPECT_LT(spread[spread.size() * 95 / 100], 2.2);
  RecordProperty("smallest_angle_degrees", std::to_string(worst));
  EXPECT_LT(slender, 0.08 * static_cast<double>(f.rows()));
  EXPECT_GT(worst, 8);
}

TEST(DefaultHumanRig, JointTree_MatchesSmplX) {
  const BodyModel model = plain_human(0.5);
  EXPECT_EQ(joint_count(model), 55);
  EXPECT_NO_THROW(check_skeleton(model.skeleton));
  EXPECT_EQ(model.skeleton.names[12], "neck");
  EXPECT_EQ(model.skeleton.parents[13], 9);
  EXPECT_EQ(model.skeleton.parents[54], 53);
  EXPECT_GE(find_joint(model.skeleton, "jaw"), 0);
  for (const char* finger : {"index", "middle", "pinky", "ring", "thumb"}) {
    for (const char* side : {"left_", "right_"}) {
      const int third = find_joint(model.skeleton, std::string(side) + finger + "3");
      ASSERT_GE(third, 0);
      EXPECT_EQ(model.skeleton.names[model.skeleton.parents[third]],
                std::string(side) + finger + "2");
    }
  }
}

TEST(DefaultHumanRig, SkinWeights_SumToOneAndAreSymmetric) {
  const BodyModel model = plain_human(0.5);
  const std::vector<int> mirror = mirror_map(model);
  const Index joints = joint_count(model);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(vertex_count(model), joints);
  EXPECT_LE(model.skin.joints.cols(), 8);
  EXPECT_GE(model.skin.weights.minCoeff(), 0);
  for (Index v = 0; v < dense.rows(); ++v) {
    EXPECT_NEAR(model.skin.weights.row(v).sum(), 1, 1e-12);
    for (Index s = 0; s < model.skin.joints.cols(); ++s) {
      dense(v, model.skin.joints(v, s)) += model.skin.weights(v, s);
    }
  }
  for (Index j = 0; j < joints; ++j) {
    std::string name = model.skeleton.names[j];
    Index other = j;
    if (name.rfind("left_", 0) == 0) {
      other = find_joint(model.skeleton, "right_" + name.substr(5));
    } else if (name.rfind("right_", 0) == 0) {
      continue;
    }
    for (Index v = 0; v < dense.rows(); ++v) {
      EXPECT_NEAR(dense(v, j), dense(mirror[v], other), 1e-12) << name << " vertex " << v;
    }
  }
}

TEST(DefaultHumanOptions, OptionOutOfRange_IsRefused) {
  DefaultHumanOptions options;
  options.male = 1.5;
  EXPECT_THROW(default_human(options), LogicError);
  options = {};
  options.stature = 0.5;
  EXPECT_THROW(default_human(options), LogicError);
  options = {};
  options.mass = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(default_human(options), LogicError);
  options = {};
  options.waist_girth = -1;
  EXPECT_THROW(default_human(options), LogicError);
}

TEST(DefaultHumanOptions, ImpossibleMeasure_IsNamed) {
  DefaultHumanOptions options;
  options.stature = 1.6;
  options.leg_length = 1.05;
  options.torso_length = 0.8;
  try {
    default_human(options);
    FAIL() << "legs and torso longer than the body";
  } catch (const DataError& error) {
    EXPECT_EQ(error.where, "stature");
    EXPECT_THAT(error.what(), ::testing::HasSubstr("measures of one person"));
  }
}

void expect_refused(const DefaultHumanOptions& options, const char* where, const char* words) {
  try {
    default_human(options);
    FAIL() << words;
  } catch (const DataError& error) {
    EXPECT_EQ(error.where, where);
    EXPECT_THAT(error.what(), ::testing::HasSubstr(words));
  }
}

TEST(DefaultHumanOptions, GirthContradictingTheMass_IsRefused) {
  DefaultHumanOptions options = female_human();
  options.mass = 90;
  options.waist_girth = 0.5;
  expect_refused(options, "waist_girth", "0.5 m at a stature of 1.63 m and a mass of 90 kg");
  options = male_human();
  options.neck_girth = 0.55;
  options.mass = 60;
  expect_refused(options, "neck_girth", "the girths that are given speak for");
}

TEST(DefaultHumanOptions, MassContradictingTheStature_IsRefused) {
  DefaultHumanOptions options = female_human();
  options.stature = 2.1;
  options.mass = 35;
  expect_refused(options, "mass", "a body mass index of 7.94 kg/m^2");
  options.stature = 1.5;
  options.mass = 180;
  expect_refused(options, "mass", "12 to 60 kg/m^2");
}

// Each girth alone could be someone's; all of them together hold too little or too much.
TEST(DefaultHumanOptions, GirthsContradictingTheMass_AreRefused) {
  DefaultHumanOptions options = female_human();
  options.shape_basis = false;
  options.mass = 61.5;
  options.chest_girth = 1.0;
  options.waist_girth = 0.85;
  options.hip_girth = 1.1;
  options.thigh_girth = 0.66;
  options.upper_arm_girth = 0.31;
  expect_refused(options, "mass", "no body has 61.5 kg");
  expect_refused(options, "mass", "the girths that are given speak for 72.1 kg");
}

TEST(DefaultHumanOptions, UnsetMass_FollowsTheGirths) {
  DefaultHumanOptions options = female_human();
  EXPECT_DOUBLE_EQ(likely_mass(options), 61.5);
  EXPECT_DOUBLE_EQ(expected_measures(options).mass, 61.5);
  options.waist_girth = 1.1;
  const BodyMeasurements measures = expected_measures(options);
  EXPECT_GT(measures.mass, 85);
  EXPECT_LT(measures.mass, 100);
  EXPECT_DOUBLE_EQ(measures.mass, likely_mass(options));
  EXPECT_GT(measures.hip_girth, 1.15);
  EXPECT_DOUBLE_EQ(measures.waist_girth, 1.1);
  // What stature and mass predict speaks for that mass.
  options = male_human();
  options.mass = 95;
  const BodyMeasurements heavy = expected_measures(options);
  options.waist_girth = heavy.waist_girth;
  options.chest_girth = heavy.chest_girth;
  options.hip_girth = heavy.hip_girth;
  options.thigh_girth = heavy.thigh_girth;
  EXPECT_NEAR(likely_mass(options), 95, 1);
  options.male = 2;
  EXPECT_THROW(likely_mass(options), LogicError);
}

}  // namespace
}  // namespace atelier
