#include "tests/simulation/contact_guard.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/archive.h"
#include "core/random.h"
#include "simulation/cloth_state_archive.h"
#include "simulation/contact/crossings.h"
#include "simulation/solver.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

constexpr double kDeepest = 1e-4;  // m, what the guard allows

/// Limbs that overlap where they meet: each turns about its own joint.
struct Limbs {
  std::vector<Points> parts;
  Triangles faces;

  void add(const Mesh& part) {
    Index before = 0;
    for (const Points& p : parts) {
      before += p.rows();
    }
    Triangles all(faces.rows() + part.faces.rows(), 3);
    all << faces, (part.faces.array() + static_cast<int>(before)).matrix();
    faces = all;
    parts.push_back(part.vertices);
  }
  /// Vertices with the last limb turned by `angle` about the axis z through `joint`.
  Points turned(double angle, const Eigen::RowVector3d& joint) const {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    Index rows = 0;
    for (const Points& p : parts) {
      rows += p.rows();
    }
    Points out(rows, 3);
    Index at = 0;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      Points p = parts[k];
      if (k + 1 == parts.size()) {
        p = ((p.rowwise() - joint) * turn.transpose()).rowwise() + joint;
      }
      out.middleRows(at, p.rows()) = p;
      at += p.rows();
    }
    return out;
  }
};

Mesh capsule(double radius, double length, const Eigen::RowVector3d& centre) {
  Mesh mesh = fixtures::sphere(radius, 20, 28);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    mesh.vertices(v, 1) += mesh.vertices(v, 1) > 1e-9 ? length / 2 : -length / 2;
  }
  mesh.vertices.rowwise() += centre;
  return mesh;
}

Garment sheet_at(int cells, double size, double y) {
  Garment garment =
      fixtures::garment_of(fixtures::sheet(cells, cells, size / cells, 'a'), 0.2, 400, 2e-6);
  garment.mesh.vertices.col(0).array() -= size / 2;
  garment.mesh.vertices.col(2).array() -= size / 2;
  garment.mesh.vertices.col(1).array() += y;
  garment.material.thickness = 2e-3;
  garment.material.friction = 0.3;
  return garment;
}

/// What a moving body did to cloth.
struct Course {
  double deepest = 0;
  double fastest = 0;
  double max_strain = 0;
  // T17, in frames in which no fold of the body grips the cloth: what is gripped lies in one of two
  // surfaces, so that its edges pass through the other.
  int max_pierced = 0;    ///< edges that cross, of cloth and body
  int max_inside = 0;     ///< vertices inside the body by its winding number
  double min_gap = 1;     ///< of cloth and body, over the thickness
  int grip_pierced = 0;   ///< edges that cross in the other frames
  int last_pierced = -1;  ///< at the end
  fixtures::Guard last;
  ClothState end;
};

bool never(int /*frame*/) {
  return false;
}

/// Runs `frames` frames of a body that is `at(frame)` and checks the guard every `every` frames.
/// `grips(frame)`: whether a fold of it holds the cloth.
template <class AnySolver, class At, class Grips = bool (*)(int)>
Course run(AnySolver& solver, const Triangles& faces, int frames, int every, const At& at,
           const Grips& grips = never) {
  Course course;
  for (int i = 0; i < frames; ++i) {
    Control control;
    control.body_start = at(i);
    control.body_end = at(i + 1);
    control.exact_counts = i % every == every - 1 || i + 1 == frames;
    const FrameReport report = solver.advance(control);
    course.max_strain = std::max(course.max_strain, report.strain_p95);
    if (control.exact_counts) {
      course.end = solver.state();
      course.last = fixtures::contact_guard(course.end.positions, control.body_end, faces, 2e-3);
      course.deepest = std::max(course.deepest, course.last.deepest);
      course.last_pierced = report.body_crossings;
      const bool free = !grips(i);
      int& pierced = free ? course.max_pierced : course.grip_pierced;
      pierced = std::max(pierced, report.body_crossings);
      if (free) {
        course.max_inside = std::max(course.max_inside, report.inside);
        course.min_gap = std::min(course.min_gap, report.body_gap);
      }
      course.fastest = std::max(course.fastest, course.end.velocities.rowwise().norm().maxCoeff());
    }
  }
  return course;
}

/// T17's bar for real time, of a body that is met by the vertices of the cloth alone: its edges are
/// short enough for the body's curvature (an edge of length l dips by l^2 / 8r).
void expect_no_contact_is_missed(const Course& course) {
  EXPECT_EQ(course.max_pierced, 0);
  EXPECT_EQ(course.max_inside, 0);
  EXPECT_GT(course.min_gap, 0.02);
  EXPECT_EQ(course.last_pierced, 0);
  ::testing::Test::RecordProperty("pierced_where_gripped", course.grip_pierced);
  ::testing::Test::RecordProperty("least_gap", std::to_string(course.min_gap));
}

/// 0 to 1 between two frames.
double ramp(int frame, int from, int to) {
  return std::clamp((frame - from) / double(to - from), 0.0, 1.0);
}

/// A trunk with an arm that is laid to it and lifted again.
struct ArmAndTrunk {
  Limbs body;
  Eigen::RowVector3d shoulder{0.13, 0.2, 0};

  ArmAndTrunk() {
    body.add(capsule(0.12, 0.4, {0, 0, 0}));
    body.add(capsule(0.05, 0.4, shoulder - Eigen::RowVector3d(0, 0.2, 0)));
  }
  Points at(int frame) const {
    const double down = ramp(frame, 30, 60) - ramp(frame, 75, 105);
    return body.turned((80 - 75 * down) * std::numbers::pi / 180, shoulder);
  }
};

/// Runs `solver` of a sheet that falls over both, and checks it.
template <class AnySolver>
void pinch_and_release(AnySolver& solver, const Cloth& cloth, const ArmAndTrunk& scene) {
  const Course course =
      run(solver, scene.body.faces, 125, 5, [&](int frame) { return scene.at(frame); });
  EXPECT_LT(course.deepest, kDeepest);
  EXPECT_LT(course.fastest, 6);
  EXPECT_LT(course.max_strain, 0.2);
  EXPECT_EQ(course.last.excused, 0) << "nothing is left between arm and trunk";
  EXPECT_EQ(count_crossings(course.end.positions, cloth.faces), 0);
  expect_no_contact_is_missed(course);
}

TEST(ContactGuard, ArmLaidToTheTrunk_PinchesAndReleasesCloth) {
  const ArmAndTrunk scene;
  const Cloth cloth = make_cloth(sheet_at(44, 0.6, 0.36));
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    options.substeps = 20;  // finer cloth takes more
    ClothSolver solver(cloth, scene.body.faces, options, device);
    pinch_and_release(solver, cloth, scene);
  }
}

/// Any solver by the names that ClothSolver has.
struct SolverOfAnyName {
  std::unique_ptr<Solver> solver;

  FrameReport advance(const Control& control) { return solver->step(control); }
  ClothState state() const { return solver->state(); }
};

TEST(ProjectiveGuard, ArmLaidToTheTrunk_PinchesAndReleasesCloth) {
  const ArmAndTrunk scene;
  const Cloth cloth = make_cloth(sheet_at(44, 0.6, 0.36));
  SolverOptions options;  // 5 substeps
  options.name = "projective-friction";
  options.self_contact = true;
  for (Device device : fixtures::devices()) {
    SolverOfAnyName solver{create_solver({cloth, scene.body.faces}, options, device)};
    pinch_and_release(solver, cloth, scene);
  }
}

TEST(ContactGuard, KneeFoldedOverCloth_ReleasesIt) {
  Limbs body;
  body.add(capsule(0.08, 0.35, {0, 0.2, 0}));
  const Eigen::RowVector3d knee(0, 0, 0);
  body.add(capsule(0.06, 0.35, {0, -0.2, 0}));
  // The shank swings up behind to 135 degrees: calf and thigh overlap by centimetres, and the fold
  // closes no faster than cloth may leave it (`depenetration_speed`).
  const auto at = [&](int frame) {
    return body.turned((ramp(frame, 10, 50) - ramp(frame, 60, 100)) * 135 * std::numbers::pi / 180,
                       knee);
  };
  Garment garment = sheet_at(28, 0.5, 0);
  // It hangs behind the leg from its upper edge.
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d p = garment.mesh.vertices.row(v);
    garment.mesh.vertices.row(v) << 0.1, 0.05 + p.x(), p.z();
  }
  const std::vector<int> top = fixtures::vertices_where(
      garment.mesh.vertices, [](double, double y, double) { return y > 0.299; });
  const Cloth cloth = make_cloth(garment, top);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, body.faces, options, device);
    // Bent by more than a right angle.
    const Course course =
        run(solver, body.faces, 120, 5, at, [](int frame) { return frame > 36 && frame < 74; });
    EXPECT_LT(course.deepest, kDeepest);
    EXPECT_LT(course.fastest, 10);
    EXPECT_LT(course.max_strain, 0.25);
    EXPECT_EQ(course.last.excused, 0);
    EXPECT_EQ(count_crossings(course.end.positions, cloth.faces), 0);
    expect_no_contact_is_missed(course);
  }
}

// T17: three sheets stacked on a sphere that begins to spin.
TEST(ContactGuard, ThreeSheetsOnASpinningSphere_DoNotCross) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  std::vector<Cloth> sheets;
  for (int k = 0; k < 3; ++k) {
    sheets.push_back(make_cloth(sheet_at(16 + k, 0.4, 0.205 + 0.004 * k)));
  }
  const Cloth cloth = join_cloths(sheets);
  const auto at = [&](int frame) -> Points {
    const double angle = 0.04 * std::max(0, frame - 30);
    return ball.vertices * Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  };
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, ball.faces, options, device);
    int resting = 0;
    int spinning = 0;
    const Course course = run(solver, ball.faces, 70, 5, [&](int frame) {
      if (frame % 10 == 9) {
        int& most = frame < 40 ? resting : spinning;
        most = std::max(most, count_crossings(solver.state().positions, cloth.faces));
      }
      return at(frame);
    });
    EXPECT_EQ(resting, 0);
    EXPECT_EQ(spinning, 0);
    EXPECT_LT(course.deepest, kDeepest);
    EXPECT_LT(course.max_strain, 0.1);
    expect_no_contact_is_missed(course);
  }
}

// Only vertices of the cloth meet what is smooth of the body, so that the thickness has to make up
// for what edges dip below it: here 0.5 mm. Sheets of half as many vertices dip by their whole
// thickness and are pierced by what is between their vertices.
TEST(ContactGuard, EdgesShortForTheCurvature_AreNotPierced) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  const Cloth cloth = make_cloth(sheet_at(20, 0.4, 0.205));
  const auto at = [&](int frame) -> Points {
    const double angle = 0.04 * std::max(0, frame - 25);
    return ball.vertices * Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  };
  for (Device device : fixtures::devices()) {
    ClothSolver solver(cloth, ball.faces, {}, device);
    const Course course = run(solver, ball.faces, 50, 5, at);
    EXPECT_LT(course.deepest, kDeepest);
    expect_no_contact_is_missed(course);
  }
}

/// Rings of vertices round the axis y, every second one turned by half a step.
Mesh tube(int around, int rings, double top, double bottom, double high, double low) {
  Mesh mesh;
  mesh.vertices.resize(around * rings, 3);
  mesh.faces.resize(2 * around * (rings - 1), 3);
  Index f = 0;
  for (int r = 0; r < rings; ++r) {
    for (int i = 0; i < around; ++i) {
      const double share = r / (rings - 1.0);
      const double angle = 2 * std::numbers::pi * (i + 0.5 * (r % 2)) / around;
      const double radius = top + (bottom - top) * share;
      mesh.vertices.row(r * around + i) << radius * std::cos(angle), high + (low - high) * share,
          radius * std::sin(angle);
      if (r + 1 < rings) {
        const int a = r * around + i;
        const int b = r * around + (i + 1) % around;
        const int c = (r + 1) * around + (r % 2 == 0 ? i : (i + 1) % around);
        const int d = (r + 1) * around + (r % 2 == 0 ? (i + around - 1) % around : i);
        mesh.faces.row(f++) << a, b, c;
        mesh.faces.row(f++) << a, c, d;
      }
    }
  }
  return mesh;
}

/// Hips, a leg and one that kicks by up to 80 degrees, while all of it spins by half a turn to and
/// fro and shakes: from any time on, at which the leg comes up from below.
struct Kicks {
  Limbs body;
  double start;  // s

  explicit Kicks(double seconds) : start(seconds) {
    body.add(capsule(0.15, 0.1, {0, 0, 0}));
    body.add(capsule(0.07, 0.4, {-0.08, -0.3, 0}));
    body.add(capsule(0.07, 0.4, hip() - Eigen::RowVector3d(0, 0.22, 0)));
  }
  static Eigen::RowVector3d hip() { return {0.08, -0.08, 0}; }
  Points placed(const Points& points, int frame) const {
    const double t = start + frame / 60.0;
    const Eigen::Matrix3d spin =
        Eigen::AngleAxisd(1.6 * std::sin(5 * t), Eigen::Vector3d::UnitY()).toRotationMatrix();
    return (points * spin.transpose()).rowwise() +
           Eigen::RowVector3d(0.05 * std::sin(9 * t), 0.05 * std::sin(11 * t), 0);
  }
  Points at(int frame) const {
    const double t = start + frame / 60.0;
    const double raised = start > 0 ? ramp(frame, 0, 30) : 1;
    return placed(body.turned(1.4 * raised * std::pow(std::sin(4 * t), 2), hip()), frame);
  }
};

// A small skirt in the same motion: what crosses itself does not become more over 600 frames.
TEST(ContactGuard, Crossings_DoNotGrowOver600Frames) {
  constexpr int kFrames = 600;
  Garment garment = fixtures::garment_of(tube(24, 8, 0.155, 0.32, 0.02, -0.4), 0.2, 400, 2e-6);
  garment.material.thickness = 2e-3;
  std::vector<int> waist;
  for (int i = 0; i < 24; ++i) {
    waist.push_back(i);
  }
  const Cloth cloth = make_cloth(garment, waist);
  for (Device device : fixtures::devices()) {
    const Kicks kicks(0);
    XpbdOptions options;
    options.self_contact = true;
    options.report = false;
    options.intersection_interval = 5;
    ClothSolver solver(cloth, kicks.body.faces, options, device);
    ClothState state = rest_state(cloth);
    state.positions = kicks.placed(state.positions, 0);
    solver.set_state(state);
    fixtures::Tenths crossings(kFrames);
    int touching = 0;  // frames in which cloth pushes cloth
    for (int i = 0; i < kFrames; ++i) {
      Control control;
      control.body_start = kicks.at(i);
      control.body_end = kicks.at(i + 1);
      control.pin_targets = kicks.placed(cloth.rest_positions, i + 1);
      const FrameReport report = solver.advance(control);
      touching += report.self_contacts > 0 ? 1 : 0;
      if (report.crossings >= 0) {
        crossings.add(i, report.crossings);
      }
    }
    EXPECT_LE(crossings.late(), crossings.early()) << crossings.text();
    EXPECT_GT(touching, kFrames / 10) << "there is something that may cross";
    RecordProperty(std::string("crossings_by_tenth_") + device_name(device), crossings.text());
  }
}

/// Where a course of many frames is, and what it found. In scripts/soak, where ATELIER_SOAK_KEEP
/// names a folder, it is kept there every 500 frames and said; the same command goes on from there.
struct KeptCourse {
  std::filesystem::path file;          ///< empty: nothing is kept
  int frame = 0;                       ///< of all courses
  ClothState state;                    ///< at its start
  double deepest = 0;                  ///< m
  double looked_at = 0;                ///< frames whose depth and crossings were counted
  fixtures::Tenths strain, crossings;  ///< of each course

  /// `frames` of all courses, `of_each` of one.
  KeptCourse(const std::string& name, int frames, int of_each, Index vertices)
      : strain(of_each), crossings(of_each) {
    const char* folder = fixtures::soaking() ? std::getenv("ATELIER_SOAK_KEEP") : nullptr;
    if (folder == nullptr) {
      return;
    }
    file = std::filesystem::path(folder) / (name + "_" + std::to_string(frames) + ".h5");
    if (!std::filesystem::exists(file)) {
      return;
    }
    Archive archive = read_archive(file, "atelier.cloth_state", 1);
    visit_numbers([&](const std::string& of, double& value) {
      value = archive.numbers.at(of);
      archive.numbers.erase(of);
    });
    state = cloth_state_of(archive, vertices, file.string());
  }

  void keep(int done, const ClothState& now) {
    frame = done;
    if (file.empty() || done % 500 != 0) {
      return;
    }
    Archive archive = archive_of(now);
    visit_numbers([&](const std::string& of, double& value) { archive.numbers[of] = value; });
    write_archive(file, archive);
    std::cout << file.stem().string() << ": " << looked_at << " frames, deepest " << deepest
              << " m, crossings " << crossings.text() << std::endl;
  }

  template <class Visit>
  void visit_numbers(const Visit& visit) {
    double done = frame;
    visit("done", done);
    frame = static_cast<int>(done);
    visit("deepest", deepest);
    visit("looked_at", looked_at);
    for (std::size_t k = 0; k < strain.most().size(); ++k) {
      visit("strain_" + std::to_string(k), strain.most()[k]);
      visit("crossings_" + std::to_string(k), crossings.most()[k]);
    }
  }
};

/// A number in the environment of scripts/soak.
int soak_number(const char* name, int usual) {
  const char* value = fixtures::soaking() ? std::getenv(name) : nullptr;
  return value != nullptr ? std::atoi(value) : usual;
}

/// A skirt in extreme motion, for as long as anyone likes: 300 frames here, of which every tenth is
/// looked at, 100,000 in scripts/soak, every one. There, of ATELIER_SOAK_PARTS shares of the
/// courses, ATELIER_SOAK_PART, from 0.
void survive_extreme_motion(const std::string& solver_name, Device device) {
  Garment garment = fixtures::garment_of(tube(28, 12, 0.155, 0.3, 0.02, -0.4), 0.2, 400, 2e-6);
  garment.material.thickness = 2e-3;
  std::vector<int> waist;
  for (int i = 0; i < 28; ++i) {
    waist.push_back(i);
  }
  const Cloth cloth = make_cloth(garment, waist);
  const std::vector<double> starts =
      fixtures::soaking() ? std::vector<double>{0, 3.1, 7.7, 12.9} : std::vector<double>{0, 7.7};
  const int parts = soak_number("ATELIER_SOAK_PARTS", 1);
  const int part = soak_number("ATELIER_SOAK_PART", 0);
  const int every = fixtures::soaking() ? 1 : 10;
  const int all_frames = fixtures::frames_or_soak(300);
  const int frames = all_frames / static_cast<int>(starts.size());
  const std::string of =
      solver_name + "_" + device_name(device) + (parts > 1 ? "_part_" + std::to_string(part) : "");
  KeptCourse course(of, all_frames, frames, cloth.rest_positions.rows());
  for (std::size_t c = 0; c < starts.size(); ++c) {
    const int first = static_cast<int>(c) * frames;
    if (course.frame >= first + frames) {
      continue;  // done another day
    }
    if (static_cast<int>(c) % parts != part) {
      course.frame = first + frames;
      continue;
    }
    const Kicks kicks(starts[c]);
    SolverOptions options;
    options.name = solver_name;
    options.self_contact = true;
    const std::unique_ptr<Solver> solver =
        create_solver({cloth, kicks.body.faces}, options, device);
    ClothState state = rest_state(cloth);
    state.positions = kicks.placed(state.positions, 0);
    solver->set_state(course.frame > first ? course.state : state);
    for (int i = course.frame - first; i < frames; ++i) {
      Control control;
      control.body_start = kicks.at(i);
      control.body_end = kicks.at(i + 1);
      control.pin_targets = kicks.placed(cloth.rest_positions, i + 1);
      course.strain.add(i, solver->step(control).strain_p95);
      const ClothState now = solver->state();
      if (i % every == every - 1) {
        course.looked_at += 1;
        course.crossings.add(i, count_crossings(now.positions, cloth.faces));
        course.deepest = std::max(
            course.deepest,
            fixtures::contact_guard(now.positions, control.body_end, kicks.body.faces, 2e-3)
                .deepest);
      }
      course.keep(first + i + 1, now);
    }
  }
  const fixtures::Tenths& strain = course.strain;
  const fixtures::Tenths& crossings = course.crossings;
  EXPECT_LT(course.deepest, kDeepest);
  EXPECT_LT(std::max(strain.early(), strain.late()), 0.3);
  // Where the leg squeezes folds against the hip, which it overlaps, the body may win; such
  // crossings come apart within a few frames.
  EXPECT_LT(std::max(crossings.early(), crossings.late()), 10) << "of 1,000 edges";
  if (frames >= 100) {  // half a course has every part of the motion
    EXPECT_LT(strain.late(), 1.2 * strain.early() + 0.02) << "strain must not grow";
  }
  if (all_frames >= 2000) {
    EXPECT_LE(crossings.late(), 1.5 * crossings.early() + 10) << "crossings must not grow";
  }
  if (fixtures::soaking()) {
    std::cout << of << ": " << course.looked_at << " frames looked at, deepest vertex "
              << 1e3 * course.deepest << " mm, crossings in the worst frame "
              << std::max(crossings.early(), crossings.late()) << ", strain of the worst frame "
              << std::max(strain.early(), strain.late()) << std::endl;
  }
  ::testing::Test::RecordProperty("crossings_by_tenth_" + of, crossings.text());
  ::testing::Test::RecordProperty("strain_by_tenth_" + of, strain.text());
  ::testing::Test::RecordProperty("deepest_" + of, std::to_string(course.deepest));
}

TEST(ContactGuard, Skirt_SurvivesExtremeMotion) {
  for (Device device : fixtures::devices()) {
    survive_extreme_motion("xpbd", device);
  }
}

TEST(ProjectiveGuard, Skirt_SurvivesExtremeMotion) {
  for (Device device : fixtures::devices()) {
    survive_extreme_motion("projective-friction", device);
  }
}

// T17: a drop of fifty layers, ten elsewhere.
TEST(ContactGuard, FiftyLayers_SettleInOrder) {
  if (!fixtures::soaking()) {
    GTEST_SKIP() << "part of scripts/soak";
  }
  const Mesh floor = fixtures::incline(0, 2);
  std::vector<Cloth> layers;
  for (int k = 0; k < 50; ++k) {
    layers.push_back(make_cloth(sheet_at(8 + k % 3, 0.15, 0.003 + 0.006 * k)));
  }
  const Cloth cloth = join_cloths(layers);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, floor.faces, options, device);
    Control control;
    control.body_start = floor.vertices;
    control.body_end = floor.vertices;
    for (int i = 0; i < 120; ++i) {
      solver.advance(control);
      if (i % 10 == 9) {
        EXPECT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i;
      }
    }
  }
}

/// Materials over six orders of magnitude, in both membranes, each with the substeps of a usual
/// frame and with `few`.
void stay_finite(const std::string& solver_name, Device device, int few) {
  const Mesh ball = fixtures::sphere(0.1, 12, 24);
  Random random{7, 0, 0};
  const auto spread = [&](double low, double high) {
    return low * std::pow(high / low, uniform(random));
  };
  for (int trial = 0; trial < 48; ++trial) {
    Garment garment = sheet_at(8, 0.3, 0.13);
    fixtures::use_flat_rest(garment);
    garment.material.density = spread(1e-3, 1e3);
    garment.material.stretch_warp = spread(1e-1, 1e5);
    garment.material.stretch_weft = spread(1e-1, 1e5);
    garment.material.shear = spread(1e-1, 1e5);
    garment.material.bending = spread(1e-9, 1e-3);
    garment.material.friction = spread(1e-3, 1e1);
    garment.material.damping = spread(1e-7, 1e-1);
    garment.material.thickness = spread(1e-5, 1e-2);
    ClothOptions membrane;
    membrane.membrane = trial % 2 == 0 ? "springs" : "strain";
    SolverOptions options;
    options.name = solver_name;
    options.self_contact = true;
    options.substeps = options.projective.substeps = trial / 2 % 2 == 0 ? 10 : few;
    const std::unique_ptr<Solver> solver =
        create_solver({make_cloth(garment, {}, membrane), ball.faces}, options, device);
    for (int i = 0; i < 20; ++i) {
      Control control;
      control.body_start =
          ball.vertices.rowwise() + Eigen::RowVector3d(0, 0.05 * std::sin(0.4 * i), 0);
      control.body_end =
          ball.vertices.rowwise() + Eigen::RowVector3d(0, 0.05 * std::sin(0.4 * (i + 1)), 0);
      solver->step(control);  // throws where a position is not finite
    }
    EXPECT_LT(solver->state().positions.cwiseAbs().maxCoeff(), 100) << trial;
  }
}

TEST(ContactGuard, MaterialsOverSixOrdersOfMagnitude_StayFinite) {
  for (Device device : fixtures::devices()) {
    stay_finite("xpbd", device, 1);
  }
}

TEST(ProjectiveGuard, MaterialsOverSixOrdersOfMagnitude_StayFinite) {
  for (Device device : fixtures::devices()) {
    stay_finite("projective-friction", device, 1);
  }
}

}  // namespace
}  // namespace atelier
