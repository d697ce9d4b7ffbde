#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/human/human_head.h"
#include "bodymodel/human/human_template.h"

namespace atelier {
namespace {

// The committed vertices are the field's: whoever changes the anatomy makes the template again.
TEST(DefaultHumanTemplate, TemplateVertices_LieOnTheFieldOfTheAverageBuild) {
  const HumanTemplate body = human_template();
  const HumanField field = human_field(human_anatomy({}));
  int off = 0;
  double worst = 0;
  for (std::size_t v = 0; v < body.points.size(); ++v) {
    const double gap = std::abs(field_value(field, body.points[v]));
    worst = std::max(worst, gap);
    off += gap > 2e-4;
    EXPECT_EQ(body.points[v].x == 0, static_cast<int>(v) < body.middle);
  }
  std::printf("largest gap %.3f mm, %d of %zu vertices beyond 0.2 mm\n", 1e3 * worst, off,
              body.points.size());
  EXPECT_LT(worst, 0.01);  // in the crease between the thighs the field has no gradient
  EXPECT_LT(off, 0.01 * static_cast<double>(body.points.size()));
}

// Two fans of triangles with a common border: the tip of one is pushed through the other.
TEST(DefaultHumanTemplate, IntersectingSkin_IsSmoothed) {
  HumanTemplate body;
  body.middle = 0;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) {
      body.points.push_back({0.01 * (x + 1), 0.01 * y, 0});
    }
  }
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      const int a = 5 * y + x;
      body.faces.push_back({a, a + 1, a + 6});
      body.faces.push_back({a, a + 6, a + 5});
    }
  }
  const HumanTemplate same = without_crossings(body);
  EXPECT_NEAR(same.points[12].z, 0, 0);
  body.points[12] = {0.0475, 0.0325, 0.001};  // over its neighbours
  body.points[18].z = 0.002;
  const HumanTemplate smooth = without_crossings(body);
  EXPECT_LT(smooth.points[12].x, 0.04);
  EXPECT_EQ(smooth.points[0].x, body.points[0].x);
}

TEST(DefaultHumanTemplate, SourceText_KeepsEveryNumber) {
  HumanTemplate small;
  small.middle = 2;
  small.points = {{0, 0.00002, 1}, {0, 0.5, -0.25}, {0.1, 0.2, 0.3}};
  small.faces = {{0, 1, 2}, {2, 1, 0}};
  const std::string text = human_template_source(small, "00ff");
  EXPECT_THAT(text, ::testing::HasSubstr("0,1,50000,0,25000,-12500,5000,10000,15000,"));
  EXPECT_THAT(text, ::testing::HasSubstr("0,1,1,0,-1,-1,"));
  EXPECT_THAT(text, ::testing::HasSubstr("kDraft[] = \"00ff\";"));
  EXPECT_THAT(text, ::testing::HasSubstr("return {2, 3, 2, kPoints, kCorners, kDraft};"));
}

// The draft stands for the template, which takes a minute. Other processors than x86-64 may
// contract products and sums, which moves its last digits.
TEST(DefaultHumanTemplate, CommittedTemplate_MatchesTheSources) {
#if defined(__x86_64__) && !defined(__FMA__)
  EXPECT_EQ(human_template_draft(), human_template_data().draft)
      << "anatomy, field or polygoniser have changed since the template was made: run "
         "scripts/human-template";
#else
  EXPECT_EQ(std::string(human_template_data().draft).size(), 64u);
#endif
}

// A woman's head and a man's are the middle one moved a little, alike on both sides of it, and no
// part of it passes through another.
TEST(DefaultHumanHead, HeadsOfBothSexes_DifferByLessThanFourMillimetres) {
  double most = 0;
  for (double y = 868; y <= 1000; y += 3) {
    for (double x = 0; x <= 45; x += 3) {
      for (double z = -40; z <= 85; z += 5) {
        const Vec3d p = {x, y, z};
        EXPECT_EQ(norm(head_of_sex(p, 0.5) - p), 0);
        const Vec3d man = head_of_sex(p, 1) - p;
        EXPECT_NEAR(norm(man + (head_of_sex(p, 0) - p)), 0, 1e-12);
        most = std::max(most, norm(man));
        for (const Vec3d& step : {Vec3d{0.01, 0, 0}, Vec3d{0, 0.01, 0}, Vec3d{0, 0, 0.01}}) {
          EXPECT_LT(norm(head_of_sex(p + step, 1) - p - step - man), 0.005) << x << " " << y;
        }
      }
    }
  }
  EXPECT_EQ(head_of_sex({0, 900, 70}, 1).x, 0);  // the middle stays in the middle
  EXPECT_GT(most, 1);
  EXPECT_LT(most * 1.7, 4);  // millimetres at a stature of 1.7 m
}

TEST(DefaultHumanField, Field_EnclosesTheBonesAndIsSymmetric) {
  for (double male : {0.0, 0.5, 1.0}) {
    const HumanAnatomy anatomy = human_anatomy({.male = male});
    const HumanField field = human_field(anatomy);
    const HumanJoints& j = anatomy.joints;
    for (const Vec3d& p :
         {j.pelvis, j.spine1, j.spine2, j.spine3, j.neck, j.head, j.hip, j.knee, j.ankle,
          j.shoulder, j.elbow, j.wrist, j.fingers[1][1], j.fingers[4][2]}) {
      EXPECT_LT(field_value(field, p), -0.003);
      EXPECT_EQ(field_value(field, p), field_value(field, {-p.x, p.y, p.z}));
    }
    EXPECT_GT(field_value(field, {0, 0.3, 0}), 0.02);  // between the legs
    const Vec3d skin = field_project(field, {0.05, 1.2, 0.13});
    EXPECT_LT(std::abs(field_value(field, skin)), 5e-5);
    EXPECT_GT(field_normal(field, skin).z, 0.7);
  }
}

TEST(DefaultHumanAnatomy, Stations_InvertAndSectionsHaveTheirWidths) {
  const HumanAnatomy anatomy = human_anatomy({});
  for (const HumanTube* tube : {&anatomy.trunk, &anatomy.leg, &anatomy.arm}) {
    const double last = static_cast<double>(tube->sections.size() - 1);
    for (double tau = -0.5; tau <= last + 0.5; tau += 0.37) {
      EXPECT_NEAR(station_at(*tube, section_at(*tube, tau).s), tau, 1e-7);
    }
    const HumanSection section = section_at(*tube, 3.4);
    EXPECT_DOUBLE_EQ(section_radius(section, 1, 0), section.pu);
    EXPECT_DOUBLE_EQ(section_radius(section, -1, 0), section.mu);
    EXPECT_DOUBLE_EQ(section_radius(section, 0, 1), section.pv);
    EXPECT_DOUBLE_EQ(section_radius(section, 0, -1), section.mv);
  }
}

TEST(DefaultHumanAnatomy, Lengths_FollowTheBuild) {
  const HumanAnatomy plain = human_anatomy({});
  const HumanAnatomy legs = human_anatomy({.leg = 1.1});
  EXPECT_DOUBLE_EQ(legs.joints.ankle.y, plain.joints.ankle.y);
  EXPECT_GT(legs.joints.knee.y, plain.joints.knee.y);
  EXPECT_NEAR(legs.joints.neck.y - plain.joints.neck.y, 0.1 * (0.475 - 0.042) * 1.7, 1e-12);
  const HumanAnatomy arms = human_anatomy({.arm = 1.2});
  EXPECT_NEAR(norm(arms.joints.elbow - arms.joints.shoulder),
              1.2 * norm(plain.joints.elbow - plain.joints.shoulder), 1e-12);
}

}  // namespace
}  // namespace atelier
