#include "registration/template/followed_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/template/frame_scores.h"
#include "registration/template/garment_template.h"
#include "tests/registration/mannequin.h"

namespace atelier::fixtures {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

constexpr double kHigh = 1.05;
constexpr double kLow = 0.5;

/// A skirt that swings forwards by `swing` (rise over run), without what lies within 20 cm of
/// `hidden`.
Mesh skirt_scan(const std::vector<Capsule>& pose, double swing, const Eigen::Vector3d& hidden) {
  const auto skin = [](const Eigen::Vector3d& m, int lump) {
    return lump != Pelvis && (lump < LeftThigh || m.y() < kLow);
  };
  Mesh cloth = cone(kHigh, 0.17, kLow, 0.34, 0.012);
  std::vector<Index> kept;
  for (Index f = 0; f < cloth.faces.rows(); ++f) {
    if ((cloth.vertices.row(cloth.faces(f, 0)).transpose() - hidden).norm() > 0.2) {
      kept.push_back(f);
    }
  }
  cloth.faces = Triangles(cloth.faces(kept, Eigen::all));
  for (Index v = 0; v < cloth.vertices.rows(); ++v) {
    cloth.vertices(v, 2) += swing * (kHigh - cloth.vertices(v, 1));
  }
  return over_skin(cloth, capsule_surface(pose, 0, 0.014, skin));
}

/// Frames of a skirt each of which hides something else at the hem.
ClothedFrames hidden_by_turns(const std::vector<Capsule>& pose) {
  return frames_of({pose, pose, pose, pose}, [=](std::size_t i) {
    const double turn = 0.5 * M_PI * static_cast<double>(i);
    return skirt_scan(pose, 0.08 * (static_cast<double>(i) - 1.0),
                      {0.34 * std::cos(turn), 0.52, 0.34 * std::sin(turn)});
  });
}

/// m from the swinging cone.
Eigen::VectorXd off_cone(const Points& vertices, double swing) {
  Eigen::VectorXd off(vertices.rows());
  for (Index v = 0; v < vertices.rows(); ++v) {
    const double z = vertices(v, 2) - swing * (kHigh - vertices(v, 1));
    const double t = (vertices(v, 1) - kLow) / (kHigh - kLow);
    off[v] = std::abs(std::hypot(vertices(v, 0), z) - (1 - t) * 0.34 - t * 0.17);
  }
  return off;
}

GarmentTemplateOptions coarse(TemplateSource source) {
  GarmentTemplateOptions options;
  options.edge_length = 0.03;
  options.frame = 10;  // swings by 0
  options.source = source;
  return options;
}

double area_of(const Mesh& mesh) {
  return face_areas(mesh.vertices, mesh.faces).sum();
}

TEST(FollowedSurface, WhatOneFrameHides_IsTakenFromTheOthers) {
  const std::vector<Capsule> pose = capsules();
  const auto unhidden = [=](std::size_t) { return skirt_scan(pose, 0, {0, 0, 5}); };
  GarmentTemplateOptions first = coarse(TemplateSource::Frame);
  first.frame = 0;
  const double whole = area_of(
      garment_template(frames_of({pose}, unhidden), kClothLabel, "lower", first).garment.mesh);
  const GarmentTemplate one =
      garment_template(hidden_by_turns(pose), kClothLabel, "lower", coarse(TemplateSource::Frame));
  EXPECT_LT(area_of(one.garment.mesh), 0.96 * whole);
  const GarmentTemplate take =
      garment_template(hidden_by_turns(pose), kClothLabel, "lower", coarse(TemplateSource::Take));
  EXPECT_THAT(take.garment.boundary_names, UnorderedElementsAre("waist", "hem"));
  EXPECT_NEAR(area_of(take.garment.mesh), whole, 0.012 * whole);
  EXPECT_GT(take.area_carried, 0.01);
  EXPECT_TRUE(take.whole);
  EXPECT_LT(take.beyond, 0.01);
  Eigen::VectorXd off = off_cone(take.garment.mesh.vertices, 0);
  EXPECT_LT(off.mean(), 0.003);  // in the middle of what is 40 cm wide, 15 mm
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[static_cast<Index>(0.98 * static_cast<double>(off.size()))], 0.018);
  for (std::size_t b = 0; b < 2; ++b) {  // no bite is left
    const double end = take.garment.boundary_names[b] == "hem" ? kLow : kHigh;
    for (const int v : take.garment.boundaries[b]) {
      EXPECT_NEAR(take.garment.mesh.vertices(v, 1), end, 0.025) << take.garment.boundary_names[b];
    }
  }
}

TEST(FollowedSurface, TemplateThatLacksWhatFramesShow_IsNotWhole) {
  const std::vector<Capsule> pose = capsules();
  // The label is lost at the front of the frame that is asked for, and in no other; the others
  // agree with none, since no two of them show the same place.
  const ClothedFrames frames = hidden_by_turns(pose);
  const FollowedSurface followed = followed_surface(
      garment_template(frames, kClothLabel, "lower", coarse(TemplateSource::Frame)).garment.mesh, 1,
      frames, {0, 1, 2, 3}, kClothLabel);
  ASSERT_EQ(followed.frames.size(), 3U);
  for (const FollowedSurface::Frame& frame : followed.frames) {
    EXPECT_NE(frame.row, 1);
    EXPECT_GT(frame.beyond, 0.01);
    EXPECT_GT(frame.support, 0.8);
    EXPECT_LT(off_cone(frame.vertices, 0.08 * (static_cast<double>(frame.row) - 1)).mean(), 0.004);
  }
}

TEST(FollowedSurface, FrameInWhichItWasLost_SaysNothing) {
  FollowedSurface::Frame well;
  well.support = 0.75;
  well.beyond = 0.02;
  FollowedSurface::Frame lost;
  lost.support = 0.74;
  lost.beyond = 0.9;
  FollowedSurface followed;
  followed.frames = {lost, well, lost, lost};
  EXPECT_EQ(median_beyond(followed), 0.02);
  followed.frames = {lost, lost};
  EXPECT_EQ(median_beyond(followed), 0);

  // Frames that lost the skirt, 10 cm above it, show cloth past its hem; a template takes none of
  // it.
  const std::vector<Capsule> pose = capsules();
  const ClothedFrames frames = hidden_by_turns(pose);
  const ClothedFrame own = frames.load(1);
  constexpr double kSpacing = 0.0075;  // m
  const TakeOverview take = take_overview(frames, {0, 1, 2, 3}, kClothLabel);
  followed = followed_surface(
      garment_template(frames, kClothLabel, "lower", coarse(TemplateSource::Frame)).garment.mesh, 1,
      frames, {0, 1, 2, 3}, kClothLabel);
  const auto added = [&] {
    GarmentPoints cloud =
        garment_points(own.scan, kClothLabel, own.body, frames.body_faces, kSpacing);
    add_carried(cloud, own, take.cover, followed, frames, kSpacing);
    return cloud.points;
  };
  const Points without = added();
  lost = followed.frames.front();
  lost.vertices.col(1).array() += 0.1;
  const std::size_t well_followed = followed.frames.size();
  followed.frames.insert(followed.frames.end(), {lost, lost});  // of one frame alone none is taken
  EXPECT_GT(added().rows(), without.rows());
  for (std::size_t i = well_followed; i < followed.frames.size(); ++i) {
    followed.frames[i].support = 0.5;
  }
  EXPECT_EQ(added(), without);
}

TEST(FollowedSurface, FramesThatShowNothingMore_ChangeNothing) {
  const std::vector<Capsule> pose = capsules();
  const ClothedFrames frames = frames_of({pose, pose, pose}, [=](std::size_t i) {
    return skirt_scan(pose, 0.05 * static_cast<double>(i), {0, 0, 5});
  });
  const GarmentTemplate one =
      garment_template(frames, kClothLabel, "lower", coarse(TemplateSource::Frame));
  const GarmentTemplate take =
      garment_template(frames, kClothLabel, "lower", coarse(TemplateSource::Take));
  EXPECT_EQ(one.garment.mesh.vertices, take.garment.mesh.vertices);
  EXPECT_EQ(take.area_carried, 0);
}

TEST(Carried, RigidMotion_IsFollowedByPointsPastTheRimToo) {
  const Mesh tube = cone(1, 0.2, 0.5, 0.2, 0.03);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const auto moved = [&](const Points& points) -> Points {
    return (points * turn.transpose()).rowwise() + Eigen::RowVector3d(0.3, -1, 2);
  };
  OrientedPoints cloud{Points(3, 3), Points(3, 3)};
  cloud.points << 0.21, 0.7, 0, 0.2, 0.3, 0, 0, 1.2, 0.25;  // off it, below it, above it
  cloud.normals << 1, 0, 0, 1, 0, 0, 0, 0, 1;
  const OrientedPoints there = carried(cloud, tube.faces, tube.vertices, moved(tube.vertices));
  EXPECT_LT((there.points - moved(cloud.points)).rowwise().norm().maxCoeff(), 1e-9);
  EXPECT_LT((there.normals - cloud.normals * turn.transpose()).rowwise().norm().maxCoeff(), 1e-9);
  EXPECT_THROW(carried(cloud, tube.faces, tube.vertices, tube.vertices.topRows(3)), LogicError);
}

TEST(FrameScores, HandsAtTheCloth_LowerTheScore) {
  const std::vector<std::vector<Capsule>> poses = {capsules(0.2), capsules(0.9), capsules(0.25)};
  const ClothedFrames frames = frames_of(poses, [&](std::size_t i) {
    return skirt_scan(poses[i], 0, {0, 0, 5});
  });
  const TakeOverview take = take_overview(frames, {0, 1, 2}, kClothLabel);
  ASSERT_EQ(take.scores.size(), 3U);
  EXPECT_GT(take.scores[0].at_hands, 0.02);
  EXPECT_EQ(take.scores[1].at_hands, 0);
  EXPECT_NEAR(take.scores[1].shown, 1, 1e-9);
  EXPECT_LT(take.scores[1].folded, 0.01);
  EXPECT_EQ(best_of(take.scores).row, 1);
  EXPECT_NE(score_text(take.scores[1], take.scores).find("0% at hands"), std::string::npos);
}

TEST(FrameScores, DeepFold_IsSeen) {
  const std::vector<Capsule> pose = capsules(0.9);
  const ClothedFrames frames = frames_of({pose, pose}, [=](std::size_t i) {
    Mesh scan = skirt_scan(pose, 0, {0, 0, 5});
    for (Index v = 0; i == 1 && v < scan.vertices.rows(); ++v) {
      const double along = 0.3 * std::atan2(scan.vertices(v, 0), scan.vertices(v, 2));  // m
      if (scan.labels[static_cast<std::size_t>(v)] == kClothLabel && std::abs(along) < 0.012) {
        scan.vertices(v, 2) -= 0.1 * (1 - std::abs(along) / 0.012);
      }
    }
    return scan;
  });
  const TakeOverview take = take_overview(frames, {0, 1}, kClothLabel);
  EXPECT_LT(take.scores[0].folded, 0.005);
  EXPECT_GT(take.scores[1].folded, 0.02);
}

}  // namespace
}  // namespace atelier::fixtures
