// Whether a scan bears out a pose that nothing else holds.
#include "bodymodel/tracking/scan_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "tests/bodymodel_tracking/posed_person.h"

namespace atelier::fixtures {
namespace {

using ::testing::Contains;
using ::testing::Not;

ScanAgreement agreement_of(const Eigen::VectorXd& pose, const ScanPoints& scan,
                           const std::vector<char>& region = {}) {
  const BodySurface rest = rest_surface(fitted_human());
  return scan_agreement(fitted_human(), posed_surface(fitted_human(), rest, pose),
                        vertex_areas(rest.vertices, plain_human().mesh.faces), scan, region);
}

TEST(ScanAgreement, EachLimb_IsJudged) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  const ScanPoints scan = scan_of(x);
  EXPECT_TRUE(agreement_of(x, scan).holds);
  EXPECT_LT(agreement_of(x, scan).off, 0.001);
  EXPECT_EQ(agreement_of(x, scan).apart, 0);
  for (const char* name : {"left_shoulder", "right_elbow", "left_hip", "right_knee", "head"}) {
    SCOPED_TRACE(name);
    const ScanAgreement off = agreement_of(turned(x, name, 0.8), scan);
    EXPECT_FALSE(off.holds);
    EXPECT_GT(off.apart, 0.03);
    EXPECT_LT(off.apart, 0.8);
  }
  const ScanAgreement elbow = agreement_of(turned(x, "right_elbow", 0.8), scan);
  EXPECT_THAT(elbow.loose, Contains(find_joint(plain_human().skeleton, "right_wrist")));
  EXPECT_THAT(elbow.loose, Not(Contains(find_joint(plain_human().skeleton, "left_wrist"))));
}

TEST(ScanAgreement, ScanNoise_CostsNothing) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  ScanPoints scan = scan_of(x);
  Random random{4};
  for (Index i = 0; i < scan.points.rows(); ++i) {
    for (int c = 0; c < 3; ++c) {
      scan.points(i, c) += 0.008 * normal(random);
    }
  }
  EXPECT_TRUE(agreement_of(x, scan).holds);
}

/// The vertices that hang on a leg.
std::vector<char> leg_region() {
  std::vector<char> region;
  const Points& vertices = plain_human().mesh.vertices;
  for (Index v = 0; v < vertices.rows(); ++v) {
    const bool leg = std::abs(vertices(v, 0)) < 0.25;  // and no hand
    region.push_back(leg && vertices(v, 1) > 0.4 && vertices(v, 1) < 1.0 ? 1 : 0);
  }
  return region;
}

TEST(ScanAgreement, ExcludedClothing_IsNotJudged) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  const std::vector<char> region = leg_region();
  ScanPoints scan = scan_of(x);
  for (Index i = 0; i < scan.points.rows(); ++i) {  // a wide skirt
    if (region[static_cast<std::size_t>(i)] != 0) {
      scan.points.row(i) += 0.15 * scan.normals.row(i);
      scan.parts[static_cast<std::size_t>(i)] = ScanPart::Cloth;
    }
  }
  EXPECT_FALSE(agreement_of(x, scan).holds);
  EXPECT_TRUE(agreement_of(x, scan, region).holds);
  EXPECT_FALSE(agreement_of(turned(x, "left_knee", 0.8), scan, region).holds) << "its foot is off";
}

TEST(ScanAgreement, UnseenLimbs_AreLoose) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  const ScanPoints scan = scan_of(x);
  std::vector<char> low;
  ScanPoints left_out = scan;
  for (Index i = 0; i < scan.points.rows(); ++i) {
    low.push_back(plain_human().mesh.vertices(i, 1) < 1.0 ? 1 : 0);
    left_out.parts[static_cast<std::size_t>(i)] =
        low.back() != 0 ? ScanPart::LeftOut : ScanPart::Skin;
  }
  const ScanAgreement below = agreement_of(x, left_out);
  EXPECT_FALSE(below.holds) << "a dress to the ground";
  EXPECT_THAT(below.loose, Contains(find_joint(plain_human().skeleton, "left_ankle")));
  EXPECT_EQ(below.off, 0);
  EXPECT_FALSE(agreement_of(x, ScanPoints{}).holds);
  ScanPoints ignored = scan;
  std::fill(ignored.parts.begin(), ignored.parts.end(), ScanPart::Ignored);
  EXPECT_FALSE(agreement_of(x, ignored).holds);
  EXPECT_EQ(agreement_of(x, ignored).off, 1);
  EXPECT_THROW(agreement_of(x, scan, {1, 0}), LogicError);
}

/// What lies under a skirt, and the skirt: a cone about the legs from the waist to the shins.
ScanPoints in_a_skirt(const Eigen::VectorXd& x, ScanPart skirt) {
  const std::vector<char> region = leg_region();
  ScanPoints scan = scan_of(x);
  Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
  double inside = 0;
  double top = 0;
  for (Index i = 0; i < scan.points.rows(); ++i) {
    if (region[static_cast<std::size_t>(i)] != 0) {
      middle += scan.points.row(i);
      inside += 1;
      top = std::max(top, scan.points(i, 1));
    }
  }
  middle /= inside;
  for (Index i = 0; i < scan.points.rows(); ++i) {
    if (region[static_cast<std::size_t>(i)] != 0) {
      Eigen::RowVector3d out = scan.points.row(i) - middle;
      out[1] = 0;
      out.normalize();
      const double radius = 0.2 + 0.3 * (top - scan.points(i, 1));
      scan.points(i, 0) = middle[0] + radius * out[0];
      scan.points(i, 2) = middle[2] + radius * out[2];
      scan.normals.row(i) = (out + Eigen::RowVector3d(0, 0.3, 0)).normalized();
      scan.parts[static_cast<std::size_t>(i)] = skirt;
    }
  }
  return scan;
}

// Its nearest points are skin of calves, of a hand or of the other leg, and the skirt is far off.
TEST(ScanAgreement, LimbsUnderExcludedClothing_AreJudgedByTheSkin) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  const ScanPoints scan = in_a_skirt(x, ScanPart::LeftOut);
  EXPECT_TRUE(agreement_of(x, scan).holds);
  EXPECT_FALSE(agreement_of(x, in_a_skirt(x, ScanPart::Cloth)).holds);
  for (const char* name :
       {"left_knee", "right_hip", "left_hip", "left_shoulder", "right_elbow", "head"}) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(agreement_of(turned(x, name, 0.8), scan).holds);
    EXPECT_FALSE(agreement_of(turned(x, name, -0.8), scan).holds);
  }
  for (const char* name : {"left_knee", "left_hip", "left_shoulder", "right_elbow"}) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(agreement_of(turned(x, name, 0.3), scan).holds) << "a little, too";
  }
}

TEST(ScanAgreement, HandUnderAnExcludedSkirt_IsLoose) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  const ScanPoints scan = in_a_skirt(x, ScanPart::LeftOut);
  const ScanAgreement inside = agreement_of(turned(x, "left_shoulder", -0.9), scan);
  EXPECT_FALSE(inside.holds);
  EXPECT_THAT(inside.loose, Contains(find_joint(plain_human().skeleton, "left_wrist")));
}

TEST(ScanAgreement, UnlabelledScan_AllowsTenCentimetresPerLimb) {
  const Eigen::VectorXd x = walking(fitted_human(), 0.3);
  ScanPoints scan = scan_of(x);
  std::fill(scan.parts.begin(), scan.parts.end(), ScanPart::Cloth);
  EXPECT_TRUE(agreement_of(x, scan).holds);
  for (const char* name : {"left_shoulder", "right_shoulder", "left_hip", "right_knee"}) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(agreement_of(turned(x, name, 0.8), scan).holds);
  }
}

}  // namespace
}  // namespace atelier::fixtures
