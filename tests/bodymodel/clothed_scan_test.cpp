#include "bodymodel/underlying/clothed_scan.h"

#include <limits>

#include <gtest/gtest.h>

#include "bodymodel/underlying/body_certificate.h"
#include "bodymodel/underlying/body_cover.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/bodymodel/clothed_body.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::ball;
using fixtures::part_of;
using fixtures::sphere;
using fixtures::worn_on;

bool is_top(const Eigen::RowVector3d& p) {
  return p.y() > 0.001;
}

TEST(ClothedScan, ScanRegions_FollowTheirRoles) {
  const ScanSurface scan = scan_surface(worn_on(ball(0.3), is_top, 0.01));
  const auto skin = nearest_point(scan, scan.skin, {0, -0.35, 0}, 1);
  ASSERT_TRUE(skin);
  EXPECT_EQ(skin->role, ScanRole::Skin);
  EXPECT_NEAR(skin->distance, 0.05, 1e-3);
  EXPECT_FALSE(skin->border);
  EXPECT_GT(skin->normal.dot(Eigen::Vector3d(0, -1, 0)), 0.99);
  EXPECT_FALSE(nearest_point(scan, scan.skin, {0, -0.35, 0}, 0.04));
  const auto rim = nearest_point(scan, scan.skin, {0, 0.35, 0}, 1);
  ASSERT_TRUE(rim);
  EXPECT_TRUE(rim->border);
}

TEST(ClothedScan, ScanWithoutRoles_IsAllCloth) {
  const ScanSurface scan = scan_surface({ball(0.3), {}});
  EXPECT_EQ(scan.skin.faces.rows(), 0);
  EXPECT_EQ(scan.cover.faces.rows(), ball(0.3).faces.rows());
}

TEST(ClothedScan, Gaps_HaveASign) {
  const ScanSurface scan = scan_surface({ball(0.3), {}});
  for (const CoverSign sign : {CoverSign::Winding, CoverSign::Normal}) {
    const auto inside = cover_gap(scan, {0, 0.28, 0}, {0, 1, 0}, 0.05, sign);
    ASSERT_TRUE(inside);
    EXPECT_NEAR(inside->gap, 0.02, 1e-3);
    EXPECT_GT(inside->outward.y(), 0.99);
    const auto outside = cover_gap(scan, {0, 0.32, 0}, {0, 1, 0}, 0.05, sign);
    ASSERT_TRUE(outside);
    EXPECT_NEAR(outside->gap, -0.02, 1e-3);
    EXPECT_GT(outside->outward.y(), 0.99);
  }
  const auto unsigned_gap = cover_gap(scan, {0, 0.32, 0}, {0, 1, 0}, 0.05, CoverSign::Unsigned);
  ASSERT_TRUE(unsigned_gap);
  EXPECT_NEAR(unsigned_gap->gap, 0.02, 1e-3);
  EXPECT_LT(unsigned_gap->outward.y(), -0.99);
}

TEST(ClothedScan, ClothFacingOtherwise_DoesNotCover) {
  const ScanSurface scan = scan_surface({ball(0.3), {}});
  EXPECT_FALSE(cover_gap(scan, {0, 0.32, 0}, {0, -1, 0}, 0.05, CoverSign::Normal));
  EXPECT_FALSE(cover_gap(scan, {0, 0.1, 0}, {0, 1, 0}, 0.05, CoverSign::Normal));
}

/// Points of skin all around a ball, at `radius`: how many have a gap, and how many of them one of
/// the wrong sign or direction.
struct Signs {
  Index told = 0;
  Index wrong = 0;
};

Signs signs_at(const ScanSurface& scan, double radius, double scan_radius, CoverSign sign) {
  const Points directions = sphere(3).vertices;
  Signs signs;
  for (Index i = 0; i < directions.rows(); ++i) {
    const Eigen::Vector3d normal = directions.row(i).transpose().normalized();
    if (const auto over = cover_gap(scan, radius * normal, normal, 0.05, sign)) {
      ++signs.told;
      signs.wrong += (over->gap > 0) != (radius < scan_radius) || over->outward.dot(normal) < 0;
    }
  }
  return signs;
}

/// One face in `every`, at random.
std::vector<Index> some_faces(const Mesh& mesh, int every, std::uint64_t seed) {
  Random random{seed};
  std::vector<Index> faces;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    if (uniform(random) * every < 1) {
      faces.push_back(f);
    }
  }
  return faces;
}

// Patches that look the wrong way, as merged scans have them: over them normals say the opposite or
// nothing, while the winding number, to which all of the scan adds, is hardly changed.
TEST(ClothedScan, FlippedPatches_DoNotAffectTheWindingNumber) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    ClothedScan scan{ball(0.3, 6), {}};  // patches of 7 mm about a vertex
    Random random{seed};
    std::vector<char> turned(static_cast<std::size_t>(scan.mesh.vertices.rows()), 0);
    for (char& one : turned) {
      one = uniform(random) < 0.04 ? 1 : 0;
    }
    for (Index f = 0; f < scan.mesh.faces.rows(); ++f) {
      if ((turned[scan.mesh.faces(f, 0)] | turned[scan.mesh.faces(f, 1)] |
           turned[scan.mesh.faces(f, 2)]) != 0) {
        std::swap(scan.mesh.faces(f, 1), scan.mesh.faces(f, 2));
      }
    }
    const ScanSurface surface = scan_surface(scan);
    const double all = static_cast<double>(sphere(3).vertices.rows());
    for (const double radius : {0.26, 0.34}) {
      const Signs winding = signs_at(surface, radius, 0.3, CoverSign::Winding);
      EXPECT_GT(winding.told, 0.95 * all);
      EXPECT_EQ(winding.wrong, 0);
      const Signs normals = signs_at(surface, radius, 0.3, CoverSign::Normal);
      EXPECT_LT(normals.told - normals.wrong, 0.97 * all);
    }
  }
}

// Of a scan that looks inwards altogether sides are exchanged: skin and cloth contradict each other
// wherever the skin is, and nothing is said, where its normals take another limb's skin for
// covered.
TEST(ClothedScan, InsideOutScan_GivesNoSign) {
  ClothedScan scan{ball(0.3), {}};
  scan.mesh.faces.col(1).swap(scan.mesh.faces.col(2));
  const ScanSurface surface = scan_surface(scan);
  for (const double radius : {0.26, 0.29, 0.31, 0.34}) {
    EXPECT_EQ(signs_at(surface, radius, 0.3, CoverSign::Winding).told, 0);
  }
  EXPECT_TRUE(cover_gap(surface, {0, 0.32, 0}, {0, -1, 0}, 0.05, CoverSign::Normal));
}

// Holes of what no camera saw, and one side missing: what is told has the right sign.
TEST(ClothedScan, Holes_DoNotAffectTheWindingNumber) {
  for (const int every : {4, 10}) {
    const Mesh whole = ball(0.3);
    ClothedScan scan{whole, {}};
    const std::vector<Index> gone = some_faces(whole, every, 7);
    std::vector<char> kept(static_cast<std::size_t>(whole.faces.rows()), 1);
    for (const Index f : gone) {
      kept[static_cast<std::size_t>(f)] = 0;
    }
    Index count = 0;
    for (Index f = 0; f < whole.faces.rows(); ++f) {
      if (kept[static_cast<std::size_t>(f)] != 0) {
        scan.mesh.faces.row(count++) = whole.faces.row(f);
      }
    }
    scan.mesh.faces.conservativeResize(count, 3);
    const ScanSurface surface = scan_surface(scan);
    for (const double radius : {0.27, 0.29, 0.31, 0.33}) {
      const Signs signs = signs_at(surface, radius, 0.3, CoverSign::Winding);
      EXPECT_GT(signs.told, 50) << radius;  // the rest is nearest to a rim
      EXPECT_EQ(signs.wrong, 0) << radius;
    }
  }
  const ClothedScan half =
      part_of({ball(0.3), {}}, [](const Eigen::RowVector3d& p) { return p.z() > 0; });
  const ScanSurface surface = scan_surface(half);
  for (const double radius : {0.28, 0.32}) {
    const Signs signs = signs_at(surface, radius, 0.3, CoverSign::Winding);
    EXPECT_GT(signs.told, 0.4 * static_cast<double>(sphere(3).vertices.rows()));
    EXPECT_EQ(signs.wrong, 0);
  }
}

// A foot in a shoe whose sole no camera sees: under the instep a winding number is a half and less,
// and the sole is not outside of what lies over it.
TEST(ClothedScan, SoleMissingFromAShoe_IsNotPushedUp) {
  Mesh shoe = ball(0.12);
  shoe.vertices.col(1) *= 0.3;  // 7 cm high
  for (const double opening : {-0.02, -0.01, 0.0}) {
    const ScanSurface surface = scan_surface(
        part_of({shoe, {}}, [&](const Eigen::RowVector3d& p) { return p.y() > opening; }));
    for (double x = -0.08; x < 0.081; x += 0.02) {
      for (const double y : {-0.03, -0.02, -0.01, 0.0, 0.01}) {
        EXPECT_FALSE(cover_gap(surface, {x, y, 0.01}, {0, -1, 0}, 0.05, CoverSign::Winding))
            << opening << " " << x << " " << y;
      }
      const auto instep = cover_gap(surface, {x, 0.012, 0.01}, {0, 1, 0}, 0.05, CoverSign::Winding);
      ASSERT_TRUE(instep);
      EXPECT_GT(instep->gap, 0);
    }
  }
}

TEST(ClothedScan, BadScans_AreRefused) {
  ClothedScan scan = worn_on(ball(0.3, 2), is_top, 0.01);
  scan.roles.pop_back();
  ATELIER_EXPECT_REFUSED(scan_surface(scan, "scan.h5"), DataError, "scan.h5");
  scan = worn_on(ball(0.3, 2), is_top, 0.01);
  scan.mesh.vertices(5, 1) = std::numeric_limits<double>::quiet_NaN();
  ATELIER_EXPECT_REFUSED(scan_surface(scan), DataError, "vertex 5");
  scan = worn_on(ball(0.3, 2), is_top, 0.01);
  scan.mesh.faces(0, 0) = 1 << 20;
  ATELIER_EXPECT_REFUSED(scan_surface(scan), DataError, "face 0");
  scan.mesh.faces.resize(0, 3);
  ATELIER_EXPECT_REFUSED(scan_surface(scan), DataError, "inside from outside");
}

TEST(ClothedScan, ScansOfOtherUnitOrPlace_AreRefused) {
  const Mesh body = ball(0.9, 2);
  ClothedScan scan = worn_on(ball(0.9, 2), is_top, 0.01);
  EXPECT_NO_THROW(check_scan_of_body(scan, body.vertices));
  EXPECT_NO_THROW(check_scan_of_body({}, body.vertices));
  scan.mesh.vertices *= 1000;
  ATELIER_EXPECT_REFUSED(check_scan_of_body(scan, body.vertices, "scan.h5"), DataError,
                         "scaled by 0.001");
  scan.mesh.vertices *= 1e-5;
  ATELIER_EXPECT_REFUSED(check_scan_of_body(scan, body.vertices), DataError, "metres");
  scan.mesh.vertices *= 100;
  scan.mesh.vertices.col(0).array() += 5;
  ATELIER_EXPECT_REFUSED(check_scan_of_body(scan, body.vertices), DataError,
                         "in the same coordinates");
}

TEST(BodyCover, BareCoveredTightAndLooseSkin_AreToldApart) {
  const Mesh body = ball(0.3);
  for (const double gap : {0.004, 0.03}) {
    const ScanSurface scan = scan_surface(worn_on(body, is_top, gap));
    const BodyCover cover = body_cover(body.faces, cover_votes(body.faces, body.vertices, scan));
    for (Index v = 0; v < body.vertices.rows(); ++v) {
      const double y = body.vertices(v, 1);
      if (y > 0.08) {
        EXPECT_EQ(cover.covered[v], 1);
        EXPECT_NEAR(cover.tightness[v], std::exp(-gap * gap / 0.008 / 0.008), 0.05);
      } else if (y < -0.08) {
        EXPECT_EQ(cover.covered[v], 0);
      }
    }
    if (gap < 0.01) {
      EXPECT_NEAR(cover.gap, gap, 0.0006);
    }
  }
}

TEST(BodyCover, DistantSkirt_StillCoversTheLeg) {
  const Mesh leg = ball(0.08);
  Mesh skirt = fixtures::tube(60, 20, 1.6);
  skirt.vertices *= 0.3;
  skirt.vertices.col(1).array() -= 0.24;
  ClothedScan scan{skirt, std::vector<ScanRole>(static_cast<std::size_t>(skirt.vertices.rows()),
                                                ScanRole::Cloth)};
  const BodyCover cover =
      body_cover(leg.faces, cover_votes(leg.faces, leg.vertices, scan_surface(scan)));
  for (Index v = 0; v < leg.vertices.rows(); ++v) {
    if (std::abs(leg.vertices(v, 1)) < 0.03) {
      EXPECT_EQ(cover.covered[v], 1);
      EXPECT_EQ(cover.tightness[v], 0);
    }
  }
}

// A palm beside a skirt is near cloth, but outside of it: other frames see its skin.
TEST(BodyCover, VotesOfFrames_AreCombined) {
  const Mesh hand = ball(0.08);
  const ScanSurface seen = scan_surface(worn_on(
      hand, [](const auto&) { return false; }, 0));
  const ScanSurface hidden = scan_surface(worn_on(hand, is_top, 0.015));
  CoverVotes votes = cover_votes(hand.faces, hand.vertices, hidden);
  const Index top = 4;  // of the sphere's six first vertices none is at +Y but this
  Index up = 0;
  hand.vertices.col(1).maxCoeff(&up);
  EXPECT_GT(body_cover(hand.faces, votes).covered[up], 0.9);
  for (Index i = 0; i < top; ++i) {
    votes = votes + cover_votes(hand.faces, hand.vertices, seen);
  }
  EXPECT_EQ(body_cover(hand.faces, votes).covered[up], 0);
}

TEST(BodyCover, VotesOfTwoBodies_AreRefused) {
  const Mesh body = ball(0.3, 2);
  const Mesh other = ball(0.3, 3);
  const ScanSurface scan = scan_surface(worn_on(body, is_top, 0.01));
  ATELIER_EXPECT_REFUSED(
      cover_votes(body.faces, body.vertices, scan) + cover_votes(other.faces, other.vertices, scan),
      LogicError, "two different bodies");
}

TEST(BodyCertificate, VerticesOutsideTheCloth_AreCounted) {
  const Mesh body = ball(0.3);
  const ScanSurface scan = scan_surface(worn_on(body, is_top, 0.006));
  const BodyCover cover = body_cover(body.faces, cover_votes(body.faces, body.vertices, scan));
  const BodyCertificate under = body_certificate(body.faces, body.vertices, scan, cover);
  EXPECT_EQ(under.outside_rate, 0);
  EXPECT_NEAR(under.proximity, 0.006, 3e-4);
  EXPECT_LT(under.skin_distance, 0.001);  // but for the ring under the hem it is 0
  EXPECT_GT(under.seen_rate, 0.85);
  const BodyCertificate out =
      body_certificate(body.faces, Points(1.04 * body.vertices), scan, cover);
  EXPECT_GT(out.outside_rate, 0.99);
  EXPECT_NEAR(out.outside_depth, 0.006, 5e-4);
}

}  // namespace
}  // namespace atelier
