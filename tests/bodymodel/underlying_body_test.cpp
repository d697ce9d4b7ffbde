#include "bodymodel/underlying/underlying_body.h"

#include <Eigen/Geometry>
#include <limits>

#include <gtest/gtest.h>

#include "bodymodel/surface_frames.h"
#include "bodymodel/underlying/body_error.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tests/bodymodel/clothed_body.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::ball;
using fixtures::part_of;
using fixtures::smooth_noise;
using fixtures::worn_on;

bool is_top_vertex(const Eigen::RowVector3d& p) {
  return p.y() > 0.001;
}

/// A ball with cloth on its upper half, and a personal body that is wrong.
struct Scene {
  Mesh truth = ball(0.3);
  Mesh garment;
  ClothedScan scan;
  Points posed;
  BodyCover cover;

  explicit Scene(double gap = 0.005, double wrong = 0.006) {
    scan = worn_on(truth, is_top_vertex, gap);
    garment = part_of(scan, [](const auto& p) { return p.y() > 0.02; }).mesh;
    posed = truth.vertices + smooth_noise(truth, wrong, 5);
    posed.col(0).array() += 0.004;
    cover = body_cover(truth.faces, cover_votes(truth.faces, posed, scan_surface(scan)));
  }

  BodyError error(const Points& vertices) const {
    return body_error(truth.faces, vertices, truth, {garment});
  }
  UnderlyingBody fit(const UnderlyingBodyOptions& options = {},
                     const KnownOffsets& known = {}) const {
    return underlying_body(truth.faces, posed, scan_surface(scan), cover, known, options);
  }
};

TEST(UnderlyingBody, FittedBody_LiesOnSkinAndUnderCloth) {
  const Scene scene;
  const BodyError before = scene.error(scene.posed);
  const UnderlyingBody body = scene.fit();
  const BodyError after = scene.error(body.vertices);
  EXPECT_LT(after.mean, 0.35 * before.mean);
  EXPECT_LT(after.covered_mean, 0.5 * before.covered_mean);
  EXPECT_EQ(after.outside_rate, 0);
  EXPECT_LT(after.proximity, 0.0015);
  EXPECT_LT(body.certificate.skin_distance, 0.0005);
  EXPECT_EQ(body.certificate.outside_rate, 0);
  EXPECT_TRUE(body.trusted);
  EXPECT_TRUE(body.findings.empty());
}

TEST(UnderlyingBody, LooseCloth_DoesNotPullTheBodyOut) {
  const Scene scene(0.035, 0.003);
  const BodyError after = scene.error(scene.fit().vertices);
  EXPECT_LT(after.covered_mean, 0.003);
}

TEST(UnderlyingBody, SkinOutsideTheCloth_IsPushedBackOnlyWithASign) {
  Scene scene(0.004, 0.001);
  for (Index v = 0; v < scene.posed.rows(); ++v) {
    if (scene.truth.vertices(v, 1) > 0.2) {
      scene.posed.row(v) *= 1.05;  // 15 mm
    }
  }
  scene.cover = body_cover(scene.truth.faces,
                           cover_votes(scene.truth.faces, scene.posed, scan_surface(scene.scan)));
  EXPECT_GT(scene.error(scene.posed).outside_rate, 0.2);
  UnderlyingBodyOptions options;
  EXPECT_EQ(scene.error(scene.fit(options).vertices).outside_rate, 0);
  options.sign = CoverSign::Normal;
  EXPECT_EQ(scene.error(scene.fit(options).vertices).outside_rate, 0);
  options.sign = CoverSign::Unsigned;
  EXPECT_GT(scene.error(scene.fit(options).vertices).outside_rate, 0.1);
}

// Patches of a scan that look the wrong way: by normals nothing is known of the skin next to them.
TEST(UnderlyingBody, FlippedScanPatches_StillCover) {
  Scene scene(0.004, 0.001);
  for (Index v = 0; v < scene.posed.rows(); ++v) {
    if (scene.truth.vertices(v, 1) > 0.2) {
      scene.posed.row(v) *= 1.05;  // 15 mm
    }
  }
  scene.scan = worn_on(ball(0.3, 6), is_top_vertex, 0.004);
  Random random{11};
  std::vector<char> turned(static_cast<std::size_t>(scene.scan.mesh.vertices.rows()), 0);
  for (char& one : turned) {
    one = uniform(random) < 0.1 ? 1 : 0;
  }
  Triangles& faces = scene.scan.mesh.faces;
  for (Index f = 0; f < faces.rows(); ++f) {
    if ((turned[faces(f, 0)] | turned[faces(f, 1)] | turned[faces(f, 2)]) != 0) {
      std::swap(faces(f, 1), faces(f, 2));
    }
  }
  scene.cover = body_cover(scene.truth.faces,
                           cover_votes(scene.truth.faces, scene.posed, scan_surface(scene.scan)));
  UnderlyingBodyOptions options;
  const double winding = scene.error(scene.fit(options).vertices).outside_rate;
  options.sign = CoverSign::Normal;
  const double normals = scene.error(scene.fit(options).vertices).outside_rate;
  EXPECT_LT(winding, 0.01);
  EXPECT_LT(winding, normals);
}

TEST(UnderlyingBody, Coupling_CarriesSkinEvidenceUnderCloth) {
  Scene scene(0.03, 0);
  scene.posed = scene.truth.vertices;
  scene.posed.col(0).array() += 0.01;
  UnderlyingBodyOptions options;
  const double coupled = scene.error(scene.fit(options).vertices).vertex_covered_mean;
  options.coupling = false;
  const double alone = scene.error(scene.fit(options).vertices).vertex_covered_mean;
  EXPECT_LT(coupled, 0.007);
  EXPECT_GT(alone, 0.009);
}

// The same wrong shape in every frame: what others found of it holds where this one sees nothing.
TEST(UnderlyingBody, OffsetsOfOtherFrames_ShapeUnseenRegions) {
  const Scene scene(0.004);
  const UnderlyingBody first = scene.fit();
  Scene hidden = scene;
  hidden.scan = part_of(scene.scan, [](const auto& p) { return p.y() < -0.1; });
  UnderlyingBodyOptions options;
  const double with = hidden.error(hidden.fit(options, {first.offsets, {}}).vertices).covered_mean;
  options.temporal = false;
  const double without =
      hidden.error(hidden.fit(options, {first.offsets, {}}).vertices).covered_mean;
  EXPECT_LT(with, 0.6 * without);
}

TEST(UnderlyingBody, GivenStart_IsUsed) {
  const Scene scene;
  const UnderlyingBody body = scene.fit();
  UnderlyingBodyOptions options;
  options.iterations = 1;
  const UnderlyingBody again = scene.fit(options, {{}, body.offsets});
  EXPECT_LT((again.vertices - body.vertices).rowwise().norm().mean(), 2e-4);
}

TEST(UnderlyingBody, AnyThreadCount_GivesTheSameBits) {
  const Scene scene;
  set_thread_count(1);
  const UnderlyingBody one = scene.fit();
  set_thread_count(3);
  const UnderlyingBody three = scene.fit();
  set_thread_count(0);
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.certificate.proximity, three.certificate.proximity);
}

TEST(UnderlyingBody, NoScan_GivesThePersonalBody) {
  Scene scene;
  scene.scan = {};
  const UnderlyingBody body = scene.fit();
  EXPECT_EQ(body.vertices, scene.posed);
  EXPECT_FALSE(body.trusted);
  ASSERT_EQ(body.findings.size(), 1u);
  EXPECT_EQ(body.findings[0].code, "no-scan");
  Points up = Points::Zero(scene.posed.rows(), 3);
  up.col(2).array() += 0.01;  // along the normals
  const UnderlyingBody thicker = scene.fit({}, {up, {}});
  EXPECT_GT(thicker.vertices.rowwise().norm().mean(), scene.posed.rowwise().norm().mean() + 0.009);
}

TEST(UnderlyingBody, HalfAScan_IsReportedAndTheRestFollows) {
  Scene scene;
  scene.scan = part_of(scene.scan, [](const auto& p) { return p.x() > 0.05; });
  const UnderlyingBody body = scene.fit();
  EXPECT_FALSE(body.trusted);
  ASSERT_EQ(body.findings.size(), 1u);
  EXPECT_EQ(body.findings[0].code, "little-seen");
  EXPECT_LT(scene.error(body.vertices).mean, scene.error(scene.posed).mean);
}

TEST(UnderlyingBody, SecondPersonInTheScan_IsHarmless) {
  const Scene alone;
  Scene beside;
  Mesh& scan = beside.scan.mesh;
  const Index count = scan.vertices.rows();
  const Triangles faces = scan.faces;
  scan.vertices.conservativeResize(2 * count, 3);
  scan.vertices.bottomRows(count) = scan.vertices.topRows(count);
  scan.vertices.bottomRows(count).col(0).array() += 0.7;  // the trunk of one who stands near
  scan.faces.conservativeResize(2 * faces.rows(), 3);
  scan.faces.bottomRows(faces.rows()) = faces.array() + static_cast<int>(count);
  const std::vector<ScanRole> roles = beside.scan.roles;
  beside.scan.roles.insert(beside.scan.roles.end(), roles.begin(), roles.end());
  beside.cover = body_cover(
      beside.truth.faces, cover_votes(beside.truth.faces, beside.posed, scan_surface(beside.scan)));
  const UnderlyingBody body = beside.fit();
  EXPECT_LT((body.vertices - alone.fit().vertices).rowwise().norm().maxCoeff(), 1e-4);
  EXPECT_TRUE(body.trusted);
  EXPECT_EQ(body.certificate.outside_rate, 0);
}

TEST(UnderlyingBody, ScanWithoutLabels_OnlyKeepsTheBodyInside) {
  Scene scene;
  scene.scan.roles.clear();
  scene.cover = body_cover(scene.truth.faces,
                           cover_votes(scene.truth.faces, scene.posed, scan_surface(scene.scan)));
  const UnderlyingBody body = scene.fit();
  EXPECT_FALSE(body.trusted);
  ASSERT_EQ(body.findings.size(), 1u);
  EXPECT_EQ(body.findings[0].code, "no-skin");
  EXPECT_EQ(body.certificate.outside_rate, 0);
  EXPECT_EQ(scene.error(body.vertices).outside_rate, 0);
  EXPECT_LT(scene.error(body.vertices).mean, 0.004);  // bare skin is given the cloth's gap too
}

TEST(UnderlyingBody, DataOfAnotherBody_IsRefused) {
  const Scene scene;
  const ScanSurface scan = scan_surface(scene.scan);
  BodyCover other = scene.cover;
  other.covered.conservativeResize(3);
  ATELIER_EXPECT_REFUSED(underlying_body(scene.truth.faces, scene.posed, scan, other), LogicError,
                         "cover of another body");
  ATELIER_EXPECT_REFUSED(body_certificate(scene.truth.faces, scene.posed, scan, other), LogicError,
                         "cover of another body");
  ATELIER_EXPECT_REFUSED(scene.fit({}, {Points::Zero(3, 3), {}}), LogicError,
                         "offsets of another body");
  ATELIER_EXPECT_REFUSED(scene.fit({}, {{}, Points::Zero(3, 3)}), LogicError,
                         "offsets of another body");
  Points broken = scene.posed;
  broken(0, 0) = std::numeric_limits<double>::quiet_NaN();
  ATELIER_EXPECT_REFUSED(underlying_body(scene.truth.faces, broken, scan, scene.cover), LogicError,
                         "finite");
}

TEST(SurfaceFrames, Frames_RotateWithTheSurface) {
  const Mesh mesh = ball(0.3, 2);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const auto still = surface_frames(mesh.vertices, mesh.faces);
  const auto turned = surface_frames(Points(mesh.vertices * turn.transpose()), mesh.faces);
  for (std::size_t v = 0; v < still.size(); ++v) {
    EXPECT_LT((turned[v] - turn * still[v]).norm(), 1e-12);
    EXPECT_NEAR(still[v].determinant(), 1, 1e-12);
  }
  const Points noise = smooth_noise(mesh, 0.01, 3);
  EXPECT_LT((from_surface_frames(still, in_surface_frames(still, noise)) - noise).norm(), 1e-12);
  ATELIER_EXPECT_REFUSED(in_surface_frames(still, Points(3, 3)), LogicError, "another surface");
  ATELIER_EXPECT_REFUSED(from_surface_frames(still, Points(3, 3)), LogicError, "another surface");
}

TEST(BodyError, KnownErrors_AreMeasured) {
  const Scene scene(0.005);
  const BodyError none = scene.error(scene.truth.vertices);
  EXPECT_NEAR(none.mean, 0, 1e-9);
  EXPECT_NEAR(none.proximity, 0, 1e-9);
  EXPECT_EQ(none.outside_rate, 0);
  EXPECT_GT(none.covered, 300);
  const BodyError fat = scene.error(Points(1.03 * scene.truth.vertices));
  EXPECT_NEAR(fat.mean, 0.009, 5e-4);
  EXPECT_NEAR(fat.vertex_mean, 0.009, 1e-4);
  EXPECT_GT(fat.outside_rate, 0.8);  // not within reach of the rim
  EXPECT_NEAR(fat.outside_depth, 0.004, 5e-4);
  EXPECT_NEAR(fat.proximity, 0.009, 5e-4);
  EXPECT_NEAR(fat.proximity_bias, -0.009, 5e-4);
  const Mesh coarse = ball(0.3, 3);
  const BodyError other = body_error(coarse.faces, coarse.vertices, scene.truth, {scene.garment});
  EXPECT_EQ(other.vertex_mean, -1);
  EXPECT_LT(other.mean, 0.001);
}

}  // namespace
}  // namespace atelier
