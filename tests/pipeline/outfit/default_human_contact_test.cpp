// Cloth on the default human itself: what tests/simulation does with spheres and capsules.

#include <gtest/gtest.h>

#include "core/normals.h"
#include "simulation/contact/crossings.h"
#include "tests/pipeline/outfit/human_fixture.h"

namespace atelier {
namespace {

using fixtures::woman;
constexpr double kPi = 3.14159265358979323846;

/// 0 to 1 between two frames, slow at both ends.
double ramp(int frame, int from, int to) {
  const double t = std::clamp((frame - from) / double(to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A square dropped on her head, and how many crossings of its folds are left at most.
struct Drop {
  int cells;
  double size;  ///< m
  int crossings;
};

class DroppedOnAHuman : public ::testing::TestWithParam<Drop> {};

TEST_P(DroppedOnAHuman, DroppedCloth_HangsOutsideTheBody) {
  const double top = woman().mesh.vertices.col(1).maxCoeff();
  const Cloth cloth =
      make_cloth(fixtures::square(GetParam().cells, GetParam().size, {0, top + 0.02, 0}));
  for (const Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, woman().mesh.faces, options, device);
    const fixtures::Course course = fixtures::run_on(solver, woman().mesh.faces, 90, 15,
                                                     [](int) { return woman().mesh.vertices; });
    EXPECT_LT(course.deepest, fixtures::kDeepest);
    EXPECT_LT(course.max_strain, 0.2);
    EXPECT_GT(course.end.positions.col(1).maxCoeff(), top - 0.01) << "it stays on her head";
    EXPECT_LT(course.end.positions.col(1).minCoeff(), top - 0.3) << "its corners hang";
    const int crossings = count_crossings(course.end.positions, cloth.faces);
    EXPECT_LE(crossings, GetParam().crossings);
    RecordProperty(std::string("crossings_") + device_name(device), crossings);
  }
}

// The larger one's corners slam into folds that cross and come only partly apart: a known gap.
INSTANTIATE_TEST_SUITE_P(Squares, DroppedOnAHuman,
                         ::testing::Values(Drop{20, 0.8, 0}, Drop{24, 0.9, 60}));

class PinchedInAnArmpit : public ::testing::TestWithParam<double> {};

TEST_P(PinchedInAnArmpit, PinchedCloth_StaysOutsideAndComesOutIntact) {
  // A towel over the left shoulder; the arm goes from straight out to the side and back.
  const Eigen::Vector3d shoulder = fixtures::rest_joint("left_shoulder");
  const double aside = GetParam();
  const Garment towel = fixtures::square(
      16, 0.36, {shoulder.x() + 0.06 + aside, shoulder.y() + 0.10, shoulder.z() + aside / 2});
  const Cloth cloth = make_cloth(towel);
  const auto at = [&](int frame) {
    const double down = ramp(frame, 30, 60) - ramp(frame, 80, 110);
    return fixtures::posed_woman({{"left_shoulder", {0, 0, (45 - 85 * down) * kPi / 180}}});
  };
  for (const Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, woman().mesh.faces, options, device);
    const fixtures::Course course =
        fixtures::run_on(solver, woman().mesh.faces, 130, 1, at, cloth.faces);
    EXPECT_LT(course.deepest, fixtures::kDeepest);
    EXPECT_LT(course.max_strain, 0.3);
    EXPECT_EQ(course.excused, 0) << "nothing is left between arm and trunk";
    EXPECT_TRUE(course.end.positions.allFinite());
    const int crossings = count_crossings(course.end.positions, cloth.faces);
    EXPECT_EQ(crossings, 0);
    RecordProperty(std::string("most_crossings_") + device_name(device), course.max_crossings);
    RecordProperty(std::string("most_excused_") + device_name(device), course.max_excused);
    RecordProperty(std::string("crossings_") + device_name(device), crossings);
    RecordProperty(std::string("deepest_um_") + device_name(device),
                   std::to_string(1e6 * course.deepest));
  }
}

// Where it starts decides whom the closing arm pushes where.
INSTANTIATE_TEST_SUITE_P(Starts, PinchedInAnArmpit, ::testing::Values(0.0, 1e-4, -6e-5));

TEST(ClothOnAHuman, ClothPinchedBehindAKnee_ComesOutIntact) {
  // A cloth hangs behind the left knee, held at its upper edge; the shank swings up and back.
  const Eigen::Vector3d knee = fixtures::rest_joint("left_knee");
  Garment hanging = fixtures::square(14, 0.34, {0, 0, 0});
  for (Index v = 0; v < hanging.mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d p = hanging.mesh.vertices.row(v);
    hanging.mesh.vertices.row(v) << knee.x() + p.x(), knee.y() + 0.04 - p.z(), knee.z() - 0.12;
  }
  const double top = hanging.mesh.vertices.col(1).maxCoeff();
  const Cloth cloth = make_cloth(
      hanging, fixtures::vertices_where(hanging.mesh.vertices,
                                        [&](double, double y, double) { return y > top - 1e-6; }));
  const auto at = [&](int frame) {
    const double bent = ramp(frame, 10, 55) - ramp(frame, 70, 115);
    return fixtures::posed_woman({{"left_knee", {130 * bent * kPi / 180, 0, 0}}});
  };
  for (const Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, woman().mesh.faces, options, device);
    const fixtures::Course course = fixtures::run_on(solver, woman().mesh.faces, 130, 10, at);
    EXPECT_LT(course.deepest, fixtures::kDeepest);
    EXPECT_LT(course.max_strain, 0.3);
    EXPECT_EQ(course.excused, 0);
    EXPECT_TRUE(course.end.positions.allFinite());
    const int crossings = count_crossings(course.end.positions, cloth.faces);
    EXPECT_EQ(crossings, 0);
    RecordProperty(std::string("crossings_") + device_name(device), crossings);
    RecordProperty(std::string("deepest_um_") + device_name(device),
                   std::to_string(1e6 * course.deepest));
  }
}

TEST(ClothOnAHuman, StartOneCentimetreInside_IsResolvedGently) {
  // Her own skin from the waist to the chest as a garment, a centimetre too deep.
  const double low = fixtures::rest_joint("pelvis").y() + 0.05;
  const double high = fixtures::rest_joint("left_shoulder").y() - 0.15;
  const Points& skin = woman().mesh.vertices;
  const Points inner = skin - 0.01 * vertex_normals(skin, woman().mesh.faces);
  std::vector<int> place(static_cast<std::size_t>(skin.rows()), -1);
  std::vector<Eigen::RowVector3d> points;
  std::vector<Eigen::RowVector3i> faces;
  for (Index f = 0; f < woman().mesh.faces.rows(); ++f) {
    const Eigen::RowVector3i face = woman().mesh.faces.row(f);
    bool taken = true;
    for (const int v : {face[0], face[1], face[2]}) {
      taken = taken && skin(v, 1) > low && skin(v, 1) < high && std::abs(skin(v, 0)) < 0.2;
    }
    if (!taken) {
      continue;
    }
    Eigen::RowVector3i mine;
    for (int c = 0; c < 3; ++c) {
      int& at = place[static_cast<std::size_t>(face[c])];
      if (at < 0) {
        at = static_cast<int>(points.size());
        points.emplace_back(inner.row(face[c]));
      }
      mine[c] = at;
    }
    faces.push_back(mine);
  }
  Garment garment;
  garment.name = "too deep";
  garment.mesh.vertices.resize(static_cast<Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    garment.mesh.vertices.row(static_cast<Index>(i)) = points[i];
  }
  garment.mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    garment.mesh.faces.row(static_cast<Index>(i)) = faces[i];
  }
  garment.material.thickness = 3e-3;
  ClothOptions cloth_options;
  cloth_options.min_rest_angle = 0.5;
  const Cloth cloth = make_cloth(garment, {}, cloth_options);
  ASSERT_GT(cloth.rest_positions.rows(), 300);
  for (const Device device : fixtures::devices()) {
    ClothSolver solver(cloth, woman().mesh.faces, {}, device);
    double fastest = 0;
    Control control;
    control.body_start = control.body_end = skin;
    for (int i = 0; i < 60; ++i) {
      solver.advance(control);
      fastest = std::max(fastest, solver.state().velocities.rowwise().norm().maxCoeff());
    }
    const fixtures::Guard guard =
        fixtures::contact_guard(solver.state().positions, skin, woman().mesh.faces, 3e-3);
    EXPECT_LT(guard.deepest, fixtures::kDeepest);
    EXPECT_LT(fastest, 2.0) << "no explosion";
  }
}

}  // namespace
}  // namespace atelier
