#include "pipeline/outfit/held_cloth.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A skirt of 24 by 4 quads, 2 cm off a column of radius 0.12 m, its upper ring at y = 0.
struct Dressed {
  Mesh body = tube(24, 20, 2);
  Garment skirt;
  HeldRing waist{.garment = "lower", .opening = "waist", .rest_girth = 0.7, .stiffness = 60};

  Dressed() {
    body.vertices.col(0) *= 0.12;
    body.vertices.col(2) *= 0.12;
    body.vertices.col(1).array() -= 1;
    skirt.mesh = tube(24, 4, 1);
    skirt.mesh.vertices.col(0) *= 0.14;
    skirt.mesh.vertices.col(2) *= 0.14;
    skirt.mesh.vertices.col(1) = 0.3 * skirt.mesh.vertices.col(1).array() - 0.3;
    for (int i = 0; i < 24; ++i) {
      waist.vertices.push_back(4 * 24 + i);
    }
  }
};

TEST(HeldCloth, Bands_AreAttachedWhereTheGarmentStarts) {
  Dressed dressed;
  Garment& skirt = dressed.skirt;
  HeldRing hem = dressed.waist;
  hem.kind = HoldingKind::Rest;
  hem.vertices = {0, 1, 2, 3};
  attach_bands({dressed.waist, hem}, skirt.mesh.vertices, dressed.body.vertices, dressed.body.faces,
               skirt);
  ASSERT_THAT(skirt.attachments, SizeIs(24));
  HeldCloth held;
  add_held({}, Dressed().skirt, 0, held);
  EXPECT_EQ(pin_targets(held, dressed.body.vertices, dressed.body.faces).rows(), 0);
  const Index first = skirt.mesh.vertices.rows();
  add_held({dressed.waist, hem}, skirt, first, held);
  ASSERT_THAT(held.bands, SizeIs(1));
  EXPECT_EQ(held.bands[0].vertices[0], first + 4 * 24);
  EXPECT_EQ(held.vertices, 2 * first);
  const Points there = pin_targets(held, dressed.body.vertices, dressed.body.faces);
  ASSERT_EQ(there.rows(), 2 * first);
  for (const int v : dressed.waist.vertices) {  // drawn in a little, not moved along
    EXPECT_LT((there.row(first + v) - skirt.mesh.vertices.row(v)).norm(), 0.01);
    EXPECT_GT((there.row(first + v) - skirt.mesh.vertices.row(v)).norm(), 1e-3);
  }
  attach_bands({dressed.waist}, skirt.mesh.vertices, dressed.body.vertices, dressed.body.faces,
               skirt);
  EXPECT_THAT(skirt.attachments, SizeIs(24)) << "once";
}

TEST(HeldCloth, GarmentThatFell_IsSaidWithItsDistance) {
  Dressed dressed;
  const Points& start = dressed.skirt.mesh.vertices;
  const std::vector<RingPlace> places =
      ring_places({dressed.waist}, 100, start, dressed.body.vertices, dressed.body.faces);
  Points cloth(100 + start.rows(), 3);
  cloth.setZero();
  const auto distance = [&](double fallen) {
    cloth.bottomRows(start.rows()) = start.rowwise() + Eigen::RowVector3d(1, -fallen, 0);
    const Points body = dressed.body.vertices.rowwise() + Eigen::RowVector3d(1, 0, 0);
    return ring_distance(places[0], cloth, body, dressed.body.faces);
  };
  EXPECT_NEAR(distance(0), 0, 1e-9);
  EXPECT_NEAR(distance(0.4), 0.4, 1e-9);
  std::vector<RingLeft> left(1);
  left[0].add(distance(0.02), 3);
  EXPECT_THAT(left_places(places, left), IsEmpty());
  left[0].add(distance(0.4), 8);
  left[0].add(distance(0.3), 9);
  const std::vector<std::string> said = left_places(places, left);
  ASSERT_THAT(said, SizeIs(1));
  EXPECT_THAT(said[0], HasSubstr("lower waist: 400 mm"));
  EXPECT_THAT(said[0], HasSubstr("frame 8"));
}

TEST(HeldCloth, ChosenHolding_IsTheFoundFileOrTheNamedOneOrNone) {
  const TemporaryDirectory root;
  const Dressed dressed;
  HeldRing edited = dressed.waist;
  edited.kind = HoldingKind::Rest;
  const auto write = [&](const char* name, const std::vector<HeldRing>& rings) {
    std::ofstream(root.path() / name) << holding_text(rings);
  };
  write("found.toml", {dressed.waist});
  write("edited.toml", {edited});
  const auto chosen = [&](const std::string& option, const char* garment = "lower") {
    return chosen_holding(option, root.path() / "found.toml", {{garment, 200}});
  };
  EXPECT_EQ(chosen("").at(0).kind, HoldingKind::Band);
  EXPECT_EQ(chosen((root.path() / "edited.toml").string()).at(0).kind, HoldingKind::Rest);
  EXPECT_EQ(chosen("none").at(0).kind, HoldingKind::Rest) << "watched, as before an edit";
  EXPECT_THAT(chosen_holding("none", "", {}), IsEmpty());
  EXPECT_THROW(chosen("", "upper"), DataError);
  EXPECT_THROW(chosen((root.path() / "missing.toml").string()), DataError);
}

}  // namespace
}  // namespace atelier::fixtures
