#include "registration/tracking/holding.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/npz.h"
#include "core/tensor.h"
#include "core/topology.h"
#include "registration/tracking/holding_file.h"
#include "tests/support/shapes.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A surface of revolution round the Y axis through (radius, height), closed at both ends.
Mesh revolved(const std::vector<std::pair<double, double>>& profile, int around) {
  Mesh mesh = tube(around, static_cast<int>(profile.size()) - 1, 1);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto& [radius, height] = profile[static_cast<std::size_t>(v / around)];
    mesh.vertices(v, 0) *= radius;
    mesh.vertices(v, 2) *= radius;
    mesh.vertices(v, 1) = height;
  }
  return mesh;
}

Mesh closed_at_ends(Mesh mesh) {
  const std::vector<std::vector<int>> loops =
      boundary_loops(topology_of(mesh.faces, mesh.vertices.rows()));
  for (const std::vector<int>& loop : loops) {
    const auto middle = static_cast<int>(mesh.vertices.rows());
    Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
    for (const int v : loop) {
      at += mesh.vertices.row(v) / static_cast<double>(loop.size());
    }
    mesh.vertices.conservativeResize(middle + 1, 3);
    mesh.vertices.row(middle) = at;
    Index face = mesh.faces.rows();
    mesh.faces.conservativeResize(face + static_cast<Index>(loop.size()), 3);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      mesh.faces.row(face++) << loop[(i + 1) % loop.size()], loop[i], middle;
    }
  }
  return mesh;
}

/// A torso of 15 cm radius, shoulders that slope by 30 degrees at 1.4 m, and a neck.
Mesh mannequin_of_revolution() {
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 24; ++i) {
    profile.emplace_back(0.15, 0.2 + 0.05 * i);
  }
  for (int i = 1; i <= 6; ++i) {
    profile.emplace_back(0.15 - 0.016 * i, 1.4 + 0.009 * i);
  }
  for (int i = 1; i <= 6; ++i) {
    profile.emplace_back(0.054, 1.454 + 0.03 * i);
  }
  return closed_at_ends(revolved(profile, 48));
}

/// A walk: forward, up and down, turning.
Points moved(const Points& points, double time) {
  const double turn = 0.5 * std::sin(2 * time);
  Points out = points;
  for (Index v = 0; v < points.rows(); ++v) {
    const Eigen::RowVector3d p = points.row(v);
    out.row(v) << std::cos(turn) * p.x() + std::sin(turn) * p.z() + 0.3 * time,
        p.y() + 0.03 * std::sin(5 * time),
        -std::sin(turn) * p.x() + std::cos(turn) * p.z() + 0.1 * std::cos(time);
  }
  return out;
}

/// A take of one garment on the mannequin, whose swing grows with the depth below `hung_at` [m].
struct Worn {
  Mesh garment;
  Mesh body = mannequin_of_revolution();
  double hung_at = 1.0;
  double swing = 0.1;  ///< of the depth
  Index frames = 24;
  std::vector<std::vector<int>> loops = {};
  std::vector<std::string> names = {};

  std::vector<HeldRing> found() {
    loops = boundary_loops(topology_of(garment.faces, garment.vertices.rows()));
    names.assign(loops.size(), "opening");
    return find_holding(
        {"lower", garment.faces, loops, names, body.faces, frames,
         [this](Index frame) {
           const double time = static_cast<double>(frame) / 10;
           Points at = garment.vertices;
           for (Index v = 0; v < at.rows(); ++v) {
             const double depth = std::abs(hung_at - at(v, 1));
             at(v, 0) += swing * depth * std::sin(3 * time);
             at(v, 2) += swing * depth * std::cos(4 * time);
           }
           return moved(at, time);
         },
         [this](Index frame) { return moved(body.vertices, static_cast<double>(frame) / 10); }});
  }
  double mean_height(const HeldRing& ring) const {
    double sum = 0;
    for (const int v : ring.vertices) {
      sum += garment.vertices(v, 1) / static_cast<double>(ring.vertices.size());
    }
    return sum;
  }
};

/// A cone from a waist at 1 m, `gap` off the skin, to a hem at 0.5 m.
Mesh cone_skirt(double gap = 0.006, double hem = 0.35) {
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 20; ++i) {
    profile.emplace_back(hem + (0.15 + gap - hem) * i / 20, 0.5 + 0.025 * i);
  }
  return revolved(profile, 40);
}

TEST(Holding, SwingingSkirtOnMovingBody_IsHeldByItsWaistAndNotByItsHem) {
  Worn worn{.garment = cone_skirt()};
  const std::vector<HeldRing> rings = worn.found();
  ASSERT_THAT(rings, SizeIs(1));
  const HeldRing& waist = rings[0];
  EXPECT_EQ(waist.kind, HoldingKind::Band);
  EXPECT_TRUE(waist.closed);
  EXPECT_THAT(waist.vertices, SizeIs(40));
  EXPECT_NEAR(worn.mean_height(waist), 1.0, 1e-9);
  EXPECT_LT(waist.deviation, 0.002);
  EXPECT_NEAR(waist.gap, 0.006, 0.001);
  EXPECT_NEAR(waist.body_girth, 2 * std::numbers::pi * 0.15, 0.01);
  EXPECT_LT(waist.rest_girth, 0.96 * waist.body_girth);
  EXPECT_GT(waist.rest_girth, 0.9 * waist.body_girth);
}

TEST(Holding, BandOfHeavierGarment_IsStifferInProportion) {
  // 2 pi mu T = 3 m g at the girth of the body, which is 5% above the rest girth.
  Worn worn{.garment = cone_skirt()};
  const HeldRing ring = worn.found().at(0);
  const double slant = std::hypot(0.5, 0.35 - 0.156);
  const double weight = std::numbers::pi * (0.35 + 0.156) * slant * 0.25 * 9.81;
  const double tension = 3 * weight / (2 * std::numbers::pi * 0.4);
  EXPECT_NEAR(ring.stiffness * (1 / 0.95 - 1), tension, 0.03 * tension);
}

TEST(Holding, GarmentThatMovesWithTheBody_IsHeldByItsHighestOpening) {
  for (const Index frames : {1, 24}) {
    Worn worn{.garment = cone_skirt(0.04, 0.22), .swing = 0, .frames = frames};
    const std::vector<HeldRing> rings = worn.found();
    ASSERT_THAT(rings, SizeIs(1)) << frames;
    EXPECT_EQ(rings[0].kind, HoldingKind::Band);
    EXPECT_NEAR(worn.mean_height(rings[0]), 1.0, 1e-9);
  }
}

TEST(Holding, FrillAboveElastic_BandIsBelowTheEdge) {
  // The upper 4 cm stand off and swing, the elastic is at 0.96 m.
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 18; ++i) {
    profile.emplace_back(0.35 - 0.194 * i / 18, 0.51 + 0.025 * i);
  }
  profile.emplace_back(0.19, 0.98);
  profile.emplace_back(0.22, 1.0);
  Worn worn{.garment = revolved(profile, 40), .hung_at = 0.96, .swing = 0.4};
  const std::vector<HeldRing> rings = worn.found();
  ASSERT_THAT(rings, SizeIs(1));
  EXPECT_EQ(rings[0].kind, HoldingKind::Band);
  EXPECT_NEAR(worn.mean_height(rings[0]), 0.96, 0.03);
  EXPECT_LT(rings[0].deviation, 0.01);
}

TEST(Holding, DressOnShoulders_RestsAndHasNoBandAtItsHem) {
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 20; ++i) {
    profile.emplace_back(0.22 - 0.003 * i, 0.6 + 0.04 * i);
  }
  profile.emplace_back(0.158, 1.405);
  for (int i = 1; i <= 5; ++i) {
    profile.emplace_back(0.158 - 0.016 * i, 1.411 + 0.009 * i);
  }
  for (const double swing : {0.0, 0.15}) {
    Worn worn{.garment = revolved(profile, 40), .hung_at = 1.41, .swing = swing};
    const std::vector<HeldRing> rings = worn.found();
    ASSERT_THAT(rings, SizeIs(1)) << swing;
    EXPECT_EQ(rings[0].kind, HoldingKind::Rest);
    EXPECT_GT(worn.mean_height(rings[0]), 1.4);
    EXPECT_EQ(rings[0].rest_girth, 0);
  }
}

TEST(Holding, CowlFarOffTheNeck_RestsOnTheShouldersAllTheSame) {
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 20; ++i) {
    profile.emplace_back(0.22 - 0.003 * i, 0.6 + 0.04 * i);
  }
  for (int i = 0; i <= 5; ++i) {
    profile.emplace_back(0.158 - 0.016 * i, 1.408 + 0.009 * i);
  }
  profile.emplace_back(0.14, 1.48);
  profile.emplace_back(0.2, 1.5);
  Worn worn{.garment = revolved(profile, 40), .hung_at = 1.41, .swing = 0.1};
  const std::vector<HeldRing> rings = worn.found();
  ASSERT_THAT(rings, SizeIs(1));
  EXPECT_EQ(rings[0].kind, HoldingKind::Rest);
}

TEST(Holding, HandAtTheHipInSomeFrames_WaistIsFoundAllTheSame) {
  Worn worn{.garment = cone_skirt()};
  const Index torso = worn.body.vertices.rows();
  Mesh hand = sphere(2);
  hand.vertices *= 0.05;
  worn.body.vertices.conservativeResize(torso + hand.vertices.rows(), 3);
  const Index faces = worn.body.faces.rows();
  worn.body.faces.conservativeResize(faces + hand.faces.rows(), 3);
  worn.body.faces.bottomRows(hand.faces.rows()) = hand.faces.array() + static_cast<int>(torso);
  worn.loops = boundary_loops(topology_of(worn.garment.faces, worn.garment.vertices.rows()));
  worn.names = {"hem", "waist"};
  const auto at_hip = [](Index frame) { return frame % 3 == 0; };
  const std::vector<HeldRing> rings = find_holding(
      {"lower", worn.garment.faces, worn.loops, worn.names, worn.body.faces, 24,
       [&](Index frame) {
         Points at = worn.garment.vertices;
         for (Index v = 0; v < at.rows(); ++v) {
           at(v, 0) += 0.2 * (1 - at(v, 1)) * std::sin(static_cast<double>(frame));
         }
         return moved(at, static_cast<double>(frame) / 10);
       },
       [&](Index frame) {
         Points at = worn.body.vertices;
         at.bottomRows(hand.vertices.rows()) =
             hand.vertices.rowwise() +
             (at_hip(frame) ? Eigen::RowVector3d(0.21, 1.0, 0) : Eigen::RowVector3d(0.6, 0.7, 0.1));
         return moved(at, static_cast<double>(frame) / 10);
       }});
  ASSERT_THAT(rings, SizeIs(1));
  EXPECT_EQ(rings[0].opening, "waist");
  EXPECT_LT(rings[0].deviation, 0.003);
}

TEST(Holding, OuterSkirtOverInnerOne_IsHeldAtItsOwnWaist) {
  Worn outer{.garment = cone_skirt(0.024, 0.4)};
  const std::vector<HeldRing> rings = outer.found();
  ASSERT_THAT(rings, SizeIs(1));
  EXPECT_EQ(rings[0].kind, HoldingKind::Band);
  EXPECT_NEAR(outer.mean_height(rings[0]), 1.0, 1e-9);
  EXPECT_LT(rings[0].rest_girth, rings[0].body_girth);
}

TEST(Holding, SkirtThatWraps_IsHeldByItsUpperEdgeAlone) {
  Mesh cone = cone_skirt(0.01, 0.3);
  std::vector<Eigen::RowVector3i> kept;
  for (Index f = 0; f < cone.faces.rows(); ++f) {  // open along one line
    const bool seam =
        (cone.faces.row(f).array().unaryExpr([](int v) { return v % 40; }) == 0).any() &&
        (cone.faces.row(f).array().unaryExpr([](int v) { return v % 40; }) == 39).any();
    if (!seam) {
      kept.emplace_back(cone.faces.row(f));
    }
  }
  cone.faces.resize(static_cast<Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    cone.faces.row(static_cast<Index>(i)) = kept[i];
  }
  Worn worn{.garment = cone};
  const std::vector<HeldRing> rings = worn.found();
  ASSERT_THAT(rings, SizeIs(1));
  EXPECT_EQ(rings[0].kind, HoldingKind::Band);
  EXPECT_FALSE(rings[0].closed);
  for (const int v : rings[0].vertices) {
    EXPECT_GT(worn.garment.vertices(v, 1), 0.9);
  }
}

TEST(Holding, NothingRoundTheBody_IsNotHeld) {
  Worn worn{.garment = cone_skirt()};
  worn.garment.vertices.rowwise() += Eigen::RowVector3d(1, 0, 0);
  EXPECT_THAT(worn.found(), IsEmpty());
  Worn closed{.garment = sphere(3)};
  EXPECT_THAT(closed.found(), IsEmpty());
}

TEST(Holding, FramesOfAnotherMesh_AreRefused) {
  Worn worn{.garment = cone_skirt()};
  worn.loops = boundary_loops(topology_of(worn.garment.faces, worn.garment.vertices.rows()));
  const FollowedGarment none{
      "lower", worn.garment.faces, worn.loops, worn.names, worn.body.faces, 0, {}, {}};
  EXPECT_THROW(find_holding(none), LogicError);
  const FollowedGarment odd{
      "lower",
      worn.garment.faces,
      worn.loops,
      worn.names,
      worn.body.faces,
      2,
      [&](Index frame) -> Points {
        return worn.garment.vertices.topRows(worn.garment.vertices.rows() - frame);
      },
      [&](Index /*frame*/) { return worn.body.vertices; }};
  EXPECT_THROW(find_holding(odd), LogicError);
}

/// A frame of [F,V,3] numbers.
Points frame_in(const std::vector<double>& numbers, Index vertices, Index frame) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(numbers.data() + 3 * vertices * frame, vertices, 3);
}

TEST(Holding, SkirtOfAnotherSimulator_IsHeldByTheRingThatWasAttached) {
  ATELIER_TEST_FILE(file, "other_simulator/sequence.npz");
  const Npz npz(file);
  const auto integers = [&](const char* name) { return integers_of(npz.read(name)); };
  const auto triangles = [&](const char* name) {
    const std::vector<std::int64_t> all = integers(name);
    Triangles faces(static_cast<Index>(all.size() / 3), 3);
    for (Index i = 0; i < faces.size(); ++i) {
      faces(i / 3, i % 3) = static_cast<int>(all[static_cast<std::size_t>(i)]);
    }
    return faces;
  };
  const Tensor cloth = npz.read("cloth_vertices");
  const std::vector<double> cloth_at = doubles_of(cloth);
  const std::vector<double> body_at = doubles_of(npz.read("body_vertices"));
  const Index vertices = cloth.shape[1];
  const Triangles body_faces = triangles("body_faces");
  const Index body_vertices = static_cast<Index>(body_at.size()) / 3 / cloth.shape[0];
  Triangles faces = triangles("cloth_faces");  // sewn: the second side is the first
  std::vector<int> sewn(static_cast<std::size_t>(vertices));
  for (std::size_t v = 0; v < sewn.size(); ++v) {
    sewn[v] = static_cast<int>(v);
  }
  const std::vector<std::int64_t> seams = integers("cloth_seams");
  for (std::size_t i = 0; i + 1 < seams.size(); i += 2) {
    sewn[static_cast<std::size_t>(seams[i + 1])] = static_cast<int>(seams[i]);
  }
  for (Index i = 0; i < faces.size(); ++i) {
    int& corner = faces(i / 3, i % 3);
    corner = sewn[static_cast<std::size_t>(corner)];
  }
  const std::vector<std::vector<int>> loops = boundary_loops(topology_of(faces, vertices));
  const std::vector<HeldRing> rings =
      find_holding({"lower",
                    faces,
                    loops,
                    {},
                    body_faces,
                    cloth.shape[0],
                    [&](Index frame) { return frame_in(cloth_at, vertices, frame); },
                    [&](Index frame) { return frame_in(body_at, body_vertices, frame); }});
  ASSERT_THAT(rings, SizeIs(1));
  EXPECT_EQ(rings[0].kind, HoldingKind::Band);
  const std::vector<std::int64_t> listed = integers("cloth_attached");
  const std::set<std::int64_t> attached(listed.begin(), listed.end());
  for (const int v : rings[0].vertices) {
    EXPECT_TRUE(attached.contains(v)) << v;
  }
  EXPECT_LT(rings[0].deviation, 0.01);
  EXPECT_LT(rings[0].rest_girth, rings[0].body_girth);
}

TEST(HoldingFile, WrittenRings_AreReadAgain) {
  HeldRing waist{.garment = "lower", .opening = "waist", .rest_girth = 0.712, .stiffness = 60};
  for (int i = 0; i < 40; ++i) {
    waist.vertices.push_back(39 - i);
  }
  HeldRing neck{.garment = "upper",
                .opening = "neck",
                .kind = HoldingKind::Rest,
                .vertices = {7, 8, 9},
                .closed = false};
  const std::vector<HeldRing> again = parse_holding(holding_text({waist, neck}));
  ASSERT_THAT(again, SizeIs(2));
  EXPECT_EQ(again[0].vertices, waist.vertices);
  EXPECT_DOUBLE_EQ(again[0].rest_girth, 0.712);
  EXPECT_EQ(again[0].kind, HoldingKind::Band);
  EXPECT_EQ(again[1].kind, HoldingKind::Rest);
  EXPECT_FALSE(again[1].closed);
  EXPECT_THAT(rings_of(again, "upper"), SizeIs(1));
  EXPECT_THAT(parse_holding(holding_text({})), IsEmpty());
}

TEST(HoldingFile, RingOfAnotherGarment_IsRefusedByName) {
  const std::vector<HeldRing> rings = {
      {.garment = "lower", .opening = "waist", .vertices = {0, 1, 20}}};
  const auto words = [&](const std::vector<HeldGarment>& garments) {
    try {
      require_holding(rings, garments, "holding.toml");
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(words({{"upper", 100}}), HasSubstr("one of what is worn: upper"));
  EXPECT_THAT(words({{"lower", 20}}), HasSubstr("vertex 20"));
  EXPECT_EQ(words({{"lower", 21}}), "");
}

}  // namespace
}  // namespace atelier::fixtures
