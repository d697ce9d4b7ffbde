#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/random.h"
#include "simulation/contact/crossings.h"
#include "simulation/contact/self_crossing_math.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

Garment self_contact_square(int cells, double size, double y) {
  Garment garment =
      fixtures::garment_of(fixtures::sheet(cells, cells, size / cells, 'a'), 0.2, 400, 2e-6);
  garment.mesh.vertices.col(0).array() -= size / 2;
  garment.mesh.vertices.col(2).array() -= size / 2;
  garment.mesh.vertices.col(1).array() += y;
  garment.material.thickness = 2e-3;
  garment.material.friction = 0.3;
  return garment;
}

Control floor_control(const Mesh& floor) {
  Control control;
  control.body_start = floor.vertices;
  control.body_end = floor.vertices;
  return control;
}

TEST(Crossings, EdgesThroughTriangles_AreCounted) {
  Points x(6, 3);
  x << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, -1, 0.2, 0.2, 1, 3, 3, 3;
  Triangles faces(2, 3);
  faces << 0, 1, 2, 3, 4, 5;
  EXPECT_EQ(count_crossings(x, faces),
            2);  // 3-4 through the first, and the first's edge through the second
  x.row(4) << 0.2, 0.2, -0.5;
  x.row(5) << 3, 3, -3;
  EXPECT_EQ(count_crossings(x, faces), 0);
}

// Coordinates are dyadic and rows meet rows, so that edges pass through vertices and along edges
// exactly. As many passes count as where one sheet is a micrometre further.
TEST(Crossings, EdgesThroughVerticesAndEdges_AreCounted) {
  const Mesh lying = fixtures::sheet(8, 8, 1.0 / 16, 'a');
  Mesh standing = lying;
  for (Index v = 0; v < standing.vertices.rows(); ++v) {
    const Eigen::RowVector3d at = lying.vertices.row(v) - lying.vertices.row(0);
    standing.vertices.row(v) << 0.25, at.x() - 0.25, at.z();
  }
  standing.vertices.col(0).array() += lying.vertices(0, 0);
  standing.vertices.col(1).array() += lying.vertices(0, 1);
  standing.vertices.col(2).array() += lying.vertices(0, 2);
  const auto passes = [&](double off) {
    const Points moved = standing.vertices.rowwise() +
                         off * Eigen::RowVector3d(0.5772156649, 0.3010299957, 0.7598356856);
    return count_crossings(moved, standing.faces, lying.vertices, lying.faces);
  };
  EXPECT_GT(passes(0), 8);
  EXPECT_EQ(passes(0), passes(1e-6));
  Mesh both = lying;  // as one cloth
  const Index n = lying.vertices.rows();
  both.vertices.conservativeResize(2 * n, 3);
  both.vertices.bottomRows(n) = standing.vertices;
  both.faces.conservativeResize(2 * lying.faces.rows(), 3);
  both.faces.bottomRows(lying.faces.rows()) = standing.faces.array() + static_cast<int>(n);
  EXPECT_GT(count_crossings(both.vertices, both.faces), 8);
  standing.vertices.col(1).array() += 1;
  EXPECT_EQ(passes(0), 0);
  EXPECT_EQ(count_crossings(lying.vertices, lying.faces), 0);
}

// A pair that sticks where it was holds cloth that is pulled out sideways; one that slides lets it
// go.
TEST(SelfContact, PassingPair_SlidesOnItself) {
  const int particle[4] = {0, 1, 2, 3};
  const Vec4<double> start[4] = {{0, 0, 0, 1}, {1, 0, 0, 1}, {0, 0, 1, 1}, {0.2, 0.01, 0.2, 1}};
  Vec4<double> x[4] = {{0, 0, 0, 1}, {1, 0, 0, 1}, {0, 0, 1, 1}, {0.5, -0.05, 0.2, 1}};
  ASSERT_TRUE(passes(start, x, false));
  const Vec3<double> before{0, 0.01, 0};
  const auto slide = [&](int k, Vec3<double> push) {
    x[k] = {x[k].x + push.x, x[k].y + push.y, x[k].z + push.z, x[k].w};
  };
  slide_as_one(particle, start, x, before, slide);
  EXPECT_FALSE(passes(start, x, false));
  EXPECT_NEAR(x[3].x, 0.5, 1e-12) << "across its direction it goes on";
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(x[k].y - start[k].y, -0.06 / 4, 1e-12) << "along it all go as one";
  }
  // What is pinned leads.
  Vec4<double> pinned[4] = {{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 1, 0}, {0.5, -0.05, 0.2, 1}};
  slide_as_one(particle, start, pinned, before, [&](int k, Vec3<double> push) {
    EXPECT_EQ(k, 3);
    EXPECT_NEAR(push.y, 0.06, 1e-12);
  });
}

// Against many small steps, each of them as good as straight.
TEST(SelfContact, PassWithinASubstep_IsNotMissed) {
  constexpr int kSteps = 400;
  Random random{11, 0, 0};
  int passed = 0;
  int returned = 0;  // passed, and on their first side again
  for (int trial = 0; trial < 20000; ++trial) {
    const bool edges = trial % 2 == 0;
    Vec4<double> start[4];
    Vec4<double> x[4];
    for (int k = 0; k < 4; ++k) {
      start[k] = {uniform(random), uniform(random), uniform(random), 1};
      x[k] = {uniform(random), uniform(random), uniform(random), 1};
    }
    Vec3<double> at[4];
    bool meets = false;
    double before = spanned_volume(start, x, 0.0, at);
    for (int step = 1; step <= kSteps; ++step) {
      const double now = spanned_volume(start, x, step / double(kSteps), at);
      if ((before > 0) != (now > 0)) {
        // Clearly inside one another, as they move between two steps.
        const int split = edges ? 2 : 3;
        Vec3<double> centre{};
        for (int k = 0; k < split; ++k) {
          centre += (1.0 / split) * at[k];
        }
        for (int k = 0; k < split; ++k) {
          at[k] = centre + 0.9 * (at[k] - centre);
        }
        meets = meets || meet_in_plane(at, edges);
      }
      before = now;
    }
    if (meets) {
      EXPECT_TRUE(passes(start, x, edges)) << trial;
      ++passed;
      returned += (spanned_volume(start, x, 0.0, at) > 0) == (before > 0) ? 1 : 0;
    }
  }
  EXPECT_GT(passed, 1000);
  EXPECT_GT(returned, 10);
}

TEST(SelfContact, SheetFallingOnAnother_LandsOnIt) {
  const Mesh floor = fixtures::incline(0, 2);
  const Cloth cloth = join_cloths({make_cloth(self_contact_square(10, 0.2, 0.004)),
                                   make_cloth(self_contact_square(13, 0.2, 0.03))});
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, floor.faces, options, device);
    FrameReport report;
    for (int i = 0; i < 40; ++i) {
      report = solver.advance(floor_control(floor));
    }
    const ClothState end = solver.state();
    EXPECT_EQ(count_crossings(end.positions, cloth.faces), 0);
    EXPECT_GT(report.self_contacts, 20);
    // Lower at its own thickness, upper at two.
    EXPECT_NEAR(end.positions.col(1).head(121).mean(), 2e-3, 3e-4);
    EXPECT_NEAR(end.positions.col(1).tail(196).mean(), 4e-3, 6e-4);
  }
}

// T17: ten layers dropped together.
TEST(SelfContact, TenLayers_StayInOrder) {
  const Mesh floor = fixtures::incline(0, 2);
  std::vector<Cloth> layers;
  for (int k = 0; k < 10; ++k) {
    layers.push_back(make_cloth(self_contact_square(8 + k % 3, 0.15, 0.003 + 0.006 * k)));
  }
  const Cloth cloth = join_cloths(layers);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, floor.faces, options, device);
    for (int i = 0; i < 60; ++i) {
      solver.advance(floor_control(floor));
      if (i % 10 == 9) {
        EXPECT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i;
      }
    }
  }
}

/// A strip laid to and fro in `layers` layers of `length`, `apart` from each other, joined by half
/// circles.
Mesh folded_strip(int layers, double length, double apart) {
  constexpr int kCells = 6;
  constexpr int kTurn = 3;
  constexpr int kAcross = 5;
  std::vector<Eigen::Vector2d> profile;
  for (int k = 0; k < layers; ++k) {
    for (int c = 0; c <= kCells; ++c) {
      const double x = length * c / kCells;
      profile.emplace_back(k % 2 == 0 ? x : length - x, k * apart);
    }
    for (int c = 1; c < kTurn && k + 1 < layers; ++c) {
      const double a = std::numbers::pi * (double(c) / kTurn - 0.5);
      const double out = 0.5 * apart * std::cos(a);
      profile.emplace_back(k % 2 == 0 ? length + out : -out,
                           (k + 0.5) * apart + 0.5 * apart * std::sin(a));
    }
  }
  Mesh mesh = fixtures::sheet(kAcross, int(profile.size()) - 1, 0.02, 'a');
  for (std::size_t r = 0; r < profile.size(); ++r) {
    for (int c = 0; c <= kAcross; ++c) {
      const Index v = Index(r) * (kAcross + 1) + c;
      mesh.vertices.row(v) << profile[r].x(), profile[r].y(), 0.02 * c;
    }
  }
  return mesh;
}

// T17: ten layers of one cloth, which folds join, settle under their weight.
TEST(SelfContact, TenFoldedLayers_DoNotCross) {
  constexpr int kLayers = 10;
  const Mesh floor = fixtures::incline(0, 2);
  Garment garment = fixtures::garment_of(folded_strip(kLayers, 0.12, 6e-3), 0.2, 400, 1e-6);
  garment.mesh.vertices.col(1).array() += 3e-3;
  garment.material.thickness = 2e-3;
  garment.material.friction = 0.3;
  const Cloth cloth = make_cloth(garment);
  ASSERT_EQ(count_crossings(cloth.rest_positions, cloth.faces), 0);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, floor.faces, options, device);
    for (int i = 0; i < 60; ++i) {
      const FrameReport report = solver.advance(floor_control(floor));
      EXPECT_LT(report.penetration_depth, 1e-4) << i;
      if (i % 10 == 9) {
        EXPECT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i;
      }
    }
    // Each still lies on the one before it.
    const Points end = solver.state().positions;
    double below = 0;
    for (int k = 0; k < kLayers; ++k) {
      const double height = end.middleRows(k * 9 * 6, 7 * 6).col(1).mean();
      EXPECT_GT(height, below + 1e-3) << "layer " << k;
      below = height;
    }
    EXPECT_LT(below, 0.04) << "of 57 mm at first";
  }
}

// T17: twisted by half a turn to two turns, and strained by a half at the end.
TEST(SelfContact, TwistedStrip_DoesNotCross) {
  for (double turns : {0.5, 1.0, 2.0}) {
    constexpr int kCells = 8;
    Garment garment = fixtures::garment_of(fixtures::sheet(2 * kCells, kCells, 0.3 / kCells, 'a'),
                                           0.2, 400, 1e-6);
    garment.material.thickness = 2e-3;
    const std::vector<int> left = fixtures::vertices_where(
        garment.mesh.vertices, [](double x, double, double) { return x < 1e-9; });
    const std::vector<int> right = fixtures::vertices_where(
        garment.mesh.vertices, [](double x, double, double) { return x > 0.599; });
    std::vector<int> pins = left;
    pins.insert(pins.end(), right.begin(), right.end());
    const Cloth cloth = make_cloth(garment, pins);
    for (Device device : fixtures::devices()) {
      XpbdOptions options;
      options.self_contact = true;
      ClothSolver solver(cloth, {}, options, device);
      constexpr int kFrames = 60;
      for (int i = 0; i < kFrames; ++i) {
        const double share = (i + 1.0) / kFrames;
        Control control;
        control.gravity.setZero();
        control.pin_targets = cloth.rest_positions;
        for (int side : {-1, 1}) {
          for (int v : side < 0 ? left : right) {
            const double a = side * share * turns * 3.14159265358979323846;
            const double z = cloth.rest_positions(v, 2) - 0.15;
            control.pin_targets.row(v) << 0.3 + side * (0.3 - 0.08 * share), z * std::sin(a),
                0.15 + z * std::cos(a);
          }
        }
        solver.advance(control);
        if (i % 5 == 4) {
          ASSERT_EQ(count_crossings(solver.state().positions, cloth.faces), 0)
              << turns << " turns, frame " << i;
        }
      }
    }
  }
}

TEST(SelfContact, StripFoldedOverItself_DoesNotCross) {
  // One end of a strip is turned over and pressed through the other.
  Garment garment = fixtures::garment_of(fixtures::sheet(30, 5, 0.01, 'a'), 0.2, 400, 1e-6);
  garment.material.thickness = 2e-3;
  const std::vector<int> left = fixtures::vertices_where(
      garment.mesh.vertices, [](double x, double, double) { return x < 1e-9; });
  const std::vector<int> right = fixtures::vertices_where(
      garment.mesh.vertices, [](double x, double, double) { return x > 0.299; });
  std::vector<int> pins = left;
  pins.insert(pins.end(), right.begin(), right.end());
  const Cloth cloth = make_cloth(garment, pins);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, {}, options, device);
    Control control;
    control.gravity.setZero();
    for (int i = 0; i < 60; ++i) {
      control.pin_targets = cloth.rest_positions;
      const double a = std::min(1.0, (i + 1) / 40.0) * 3.0;
      for (int v : right) {
        control.pin_targets.row(v) << 0.12 + 0.15 * std::cos(a), 0.05 * std::sin(a),
            cloth.rest_positions(v, 2);
      }
      solver.advance(control);
    }
    EXPECT_EQ(count_crossings(solver.state().positions, cloth.faces), 0);
  }
}

TEST(SelfContact, Friction_HoldsOneSheetOnAnother) {
  // The floor is a belt; the upper sheet is carried only through the lower one, which is so large
  // that the upper one, left behind by 13 cm, does not come off it onto the belt.
  const Mesh floor = fixtures::incline(0, 2);
  const Cloth cloth = join_cloths({make_cloth(self_contact_square(20, 0.5, 0.002)),
                                   make_cloth(self_contact_square(7, 0.1, 0.004))});
  for (Device device : fixtures::devices()) {
    double carried[2];
    for (int k = 0; k < 2; ++k) {
      XpbdOptions options;
      options.self_contact = true;
      options.friction = 2;
      options.self_friction = k;
      ClothSolver solver(cloth, floor.faces, options, device);
      Points at = floor.vertices;
      for (int i = 0; i < 40; ++i) {
        Control control;
        control.body_start = at;
        at.col(0).array() += 0.2 / 60;
        control.body_end = at;
        solver.advance(control);
      }
      carried[k] = solver.state().velocities.col(0).tail(64).mean();
    }
    EXPECT_LT(carried[0], 0.05);
    EXPECT_GT(carried[1], 0.15);
  }
}

TEST(SelfContact, LayersCrossedAtTheStart_ComeApart) {
  // The outer layer begins 3 mm inside the inner one over a part.
  const Mesh floor = fixtures::incline(0, 2);
  Garment outer = self_contact_square(13, 0.15, 0.012);
  for (Index v = 0; v < outer.mesh.vertices.rows(); ++v) {
    if (outer.mesh.vertices(v, 0) > 0.03) {
      outer.mesh.vertices(v, 1) = 0.005;
    }
  }
  const Cloth cloth =
      join_cloths({make_cloth(self_contact_square(10, 0.2, 0.008)), make_cloth(outer)});
  ASSERT_GT(count_crossings(cloth.rest_positions, cloth.faces), 0);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, floor.faces, options, device);
    for (int i = 0; i < 120; ++i) {
      solver.advance(floor_control(floor));
    }
    EXPECT_EQ(count_crossings(solver.state().positions, cloth.faces), 0);
  }
}

// The order of layers says where what is crossed belongs. What nothing crosses is no worse for
// lying the other way round: an outer layer laid under an inner one, as where a pile topples.
TEST(SelfContact, UncrossedLayers_MayLieInEitherOrder) {
  const Mesh floor = fixtures::incline(0, 2);
  const Cloth cloth = join_cloths({make_cloth(self_contact_square(13, 0.2, 0.03)),
                                   make_cloth(self_contact_square(10, 0.2, 0.004))});
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    ClothSolver solver(cloth, floor.faces, options, device);
    for (int i = 0; i < 40; ++i) {
      solver.advance(floor_control(floor));
      ASSERT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i;
    }
    const Points end = solver.state().positions;
    EXPECT_NEAR(end.col(1).head(196).mean(), 4e-3, 6e-4);
    EXPECT_NEAR(end.col(1).tail(121).mean(), 2e-3, 3e-4);
  }
}

// A hem that is turned up round the edge of another layer: with one leg of the fold it lies the
// wrong way round, whichever is the outer one.
TEST(SelfContact, HemTurnedUpAroundAnotherLayer_DoesNotCrossIt) {
  const Mesh floor = fixtures::incline(0, 2);
  Garment hem = fixtures::garment_of(folded_strip(2, 0.12, 0.012), 0.2, 400, 1e-6);
  hem.mesh.vertices.col(1).array() += 3e-3;
  Garment other = self_contact_square(7, 0.09, 9e-3);
  other.mesh.vertices.col(0).array() += 0.06;
  other.mesh.vertices.col(2).array() += 0.05;
  for (Garment* garment : {&hem, &other}) {
    garment->material.thickness = 2e-3;
    garment->material.friction = 0.3;
  }
  for (const bool outside : {false, true}) {
    const Cloth cloth = outside ? join_cloths({make_cloth(other), make_cloth(hem)})
                                : join_cloths({make_cloth(hem), make_cloth(other)});
    ASSERT_EQ(count_crossings(cloth.rest_positions, cloth.faces), 0);
    for (Device device : fixtures::devices()) {
      XpbdOptions options;
      options.self_contact = true;
      ClothSolver solver(cloth, floor.faces, options, device);
      for (int i = 0; i < 40; ++i) {
        solver.advance(floor_control(floor));
        ASSERT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i << outside;
      }
      EXPECT_LT(solver.state().positions.col(1).maxCoeff(), 0.014) << "the hem has closed";
    }
  }
}

// Small enough for every sanitizer: scripts/gpu runs it under all of them.
TEST(SelfContact, ShortTwins_Agree) {
  const Mesh floor = fixtures::incline(0, 2);
  const Cloth cloth = join_cloths({make_cloth(self_contact_square(3, 0.06, 0.003)),
                                   make_cloth(self_contact_square(2, 0.05, 0.0045))});
  std::vector<Points> ends;
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    options.substeps = 4;
    ClothSolver solver(cloth, floor.faces, options, device);
    FrameReport report;
    for (int i = 0; i < 2; ++i) {
      report = solver.advance(floor_control(floor));
    }
    EXPECT_GT(report.self_contacts, 0);
    ends.push_back(solver.state().positions);
    EXPECT_LT((ends.back() - ends.front()).cwiseAbs().maxCoeff(), 1e-5) << device_name(device);
  }
}

/// Two sheets of `cells` x `cells` centimetres, two and a half millimetres apart, of which the
/// upper falls onto the lower; every 97th vertex is kicked, so that it leaves its swept motion.
struct KickedSheets {
  Cloth cloth;
  ClothState state;

  explicit KickedSheets(int cells) {
    cloth = join_cloths({make_cloth(self_contact_square(cells, 0.01 * cells, 0.05)),
                         make_cloth(self_contact_square(cells, 0.01 * cells, 0.0525))});
    state = rest_state(cloth);
    const Index n = state.velocities.rows();
    state.velocities.bottomRows(n / 2).col(1).array() -= 0.3;
    for (Index v = 0; v < n; v += 97) {
      state.velocities(v, 0) += 0.4;
    }
  }
};

// Pairs are found again for who leaves its swept motion, and nobody else: nothing is missed.
TEST(SelfContact, SearchInterval_DoesNotChangeTheResult) {
  const KickedSheets sheets(16);
  const Mesh floor = fixtures::incline(0, 2);
  for (Device device : fixtures::devices()) {
    Points first;
    int all_renewals = 0;
    for (int interval : {1, 2, 4, 10}) {
      XpbdOptions options;
      options.self_contact = true;
      options.self_interval = interval;
      ClothSolver solver(sheets.cloth, floor.faces, options, device);
      solver.set_state(sheets.state);
      int renewals = 0;
      int contacts = 0;
      for (int i = 0; i < 8; ++i) {
        const FrameReport report = solver.advance(floor_control(floor));
        renewals += report.self_renewals;
        contacts += report.self_contacts;
      }
      if (interval == 1) {
        first = solver.state().positions;
        ASSERT_EQ(count_crossings(first, sheets.cloth.faces), 0);
      }
      all_renewals += renewals;
      EXPECT_GT(contacts, 0);
      EXPECT_EQ(solver.state().positions, first) << device_name(device) << ", " << interval;
    }
    EXPECT_GT(all_renewals, 0);
  }
}

// More than 1,024 groups of edges, through which CUDA looks in one step more.
TEST(SelfContact, ShortTwinsOfALargeCloth_Agree) {
  const KickedSheets sheets(85);
  const Mesh floor = fixtures::incline(0, 2);
  std::vector<Points> ends;
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.self_contact = true;
    options.substeps = 4;
    options.self_interval = 2;
    ClothSolver solver(sheets.cloth, floor.faces, options, device);
    solver.set_state(sheets.state);
    const FrameReport report = solver.advance(floor_control(floor));
    EXPECT_GT(report.self_contacts, 0);
    EXPECT_GT(report.self_renewals, 0);
    ends.push_back(solver.state().positions);
    // Single vertices part by rounding alone where a pair just presses, or just does not.
    EXPECT_LT((ends.back() - ends.front()).rowwise().norm().mean(), 1e-4) << device_name(device);
  }
}

TEST(SelfContact, RepeatedRun_IsBitIdentical) {
  const Mesh floor = fixtures::incline(0, 2);
  const Cloth cloth = join_cloths({make_cloth(self_contact_square(10, 0.2, 0.004)),
                                   make_cloth(self_contact_square(13, 0.2, 0.02))});
  for (Device device : fixtures::devices()) {
    Points first;
    for (int run = 0; run < 3; ++run) {
      XpbdOptions options;
      options.self_contact = true;
      ClothSolver solver(cloth, floor.faces, options, device);
      for (int i = 0; i < 30; ++i) {
        solver.advance(floor_control(floor));
      }
      if (run == 0) {
        first = solver.state().positions;
      }
      EXPECT_EQ(solver.state().positions, first) << device_name(device);
    }
  }
}

}  // namespace
}  // namespace atelier
