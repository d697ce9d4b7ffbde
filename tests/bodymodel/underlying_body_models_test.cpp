#include <cmath>

#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/skinning.h"
#include "bodymodel/underlying/body_error.h"
#include "bodymodel/underlying/underlying_sequence.h"
#include "core/error.h"
#include "tests/bodymodel/clothed_body.h"
#include "tests/support/refusals.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::part_of;
using fixtures::smooth_noise;
using fixtures::worn_on;

/// A person of any model who wears something about the trunk and the thighs, and whose tracked body
/// is wrong by millimetres. Arms are left bare: what is beside them is not over them.
void fits_under_clothes(const BodyModel& model) {
  Mesh truth;
  truth.vertices = skin_vertices(model, rest_pose(model.skeleton));
  truth.faces = model.mesh.faces;
  const double height = truth.vertices.col(1).maxCoeff();
  const auto is_worn = [&](const Eigen::RowVector3d& p) {
    return p.y() > 0.35 * height && p.y() < 0.75 * height && std::abs(p.x()) < 0.09 * height;
  };
  PosedScan at;
  const ClothedScan scan = worn_on(truth, is_worn, 0.004);
  at.scan = scan_surface(scan);
  at.posed = truth.vertices + smooth_noise(truth, 0.004, 9, 100);
  const Mesh garment = part_of(scan, is_worn).mesh;
  UnderlyingSequenceOptions options;
  options.gap_frames = 0;
  const UnderlyingSequence sequence(
      truth.faces, 1, [&](Index) { return at; }, options);
  const UnderlyingBody body = sequence.at(0);
  const BodyError before = body_error(truth.faces, at.posed, truth, {garment});
  const BodyError after = body_error(truth.faces, body.vertices, truth, {garment});
  EXPECT_GT(before.covered, 500);
  EXPECT_LT(after.mean, 0.0012);
  EXPECT_LT(after.covered_mean, 0.75 * before.covered_mean);
  EXPECT_LT(after.outside_rate, 0.003);
  EXPECT_LT(after.proximity, 0.0015);
  EXPECT_TRUE(body.trusted);
}

TEST(UnderlyingBodyModels, DefaultHuman_IsFittedUnderClothes) {
  fits_under_clothes(read_body_file("default").model);
}

TEST(UnderlyingBodyModels, MakeHumanBody_IsFittedUnderClothes) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  fits_under_clothes(read_body_file(base).model);
}

/// Frames of a ball whose shape is wrong alike in all of them, and whose cloth hides another part
/// of it in each.
PosedScan ball_frame(Index frame, bool with_scan = true) {
  const Mesh truth = fixtures::ball(0.3, 3);
  PosedScan at;
  at.posed = truth.vertices + smooth_noise(truth, 0.005, 4);
  if (with_scan) {
    const double turn = 0.8 * static_cast<double>(frame);
    at.scan = scan_surface(worn_on(
        truth,
        [&](const Eigen::RowVector3d& p) {
          return p.x() * std::cos(turn) + p.y() * std::sin(turn) > 0.15;
        },
        0.03));
  }
  return at;
}

TEST(UnderlyingSequence, Frames_AreTheSameInAnyOrder) {
  const Mesh truth = fixtures::ball(0.3, 3);
  const auto load = [](Index frame) { return ball_frame(frame); };
  const UnderlyingSequence forwards(truth.faces, 5, load);
  const UnderlyingSequence backwards(truth.faces, 5, load);
  const UnderlyingBody last = backwards.at(4);
  const UnderlyingBody first = forwards.at(0);
  EXPECT_EQ(forwards.at(4).vertices, last.vertices);
  EXPECT_EQ(backwards.at(0).vertices, first.vertices);
}

TEST(UnderlyingSequence, NeighborFrames_ImproveHiddenRegions) {
  const Mesh truth = fixtures::ball(0.3, 3);
  const auto load = [](Index frame) { return ball_frame(frame); };
  UnderlyingSequenceOptions options;
  const auto error = [&] {
    const UnderlyingSequence sequence(truth.faces, 7, load, options);
    const Points body = sequence.at(3).vertices;
    double sum = 0;
    int hidden = 0;
    for (Index v = 0; v < body.rows(); ++v) {
      const Eigen::RowVector3d p = truth.vertices.row(v);
      if (p.x() * std::cos(2.4) + p.y() * std::sin(2.4) > 0.2) {
        sum += std::abs(body.row(v).norm() - 0.3);
        ++hidden;
      }
    }
    return sum / hidden;
  };
  const double with = error();
  options.body.temporal = false;
  EXPECT_LT(with, 0.9 * error());
}

TEST(UnderlyingSequence, FrameWithoutScan_IsBridged) {
  const Mesh truth = fixtures::ball(0.3, 3);
  const UnderlyingSequence sequence(truth.faces, 5,
                                    [](Index frame) { return ball_frame(frame, frame != 2); });
  const UnderlyingBody body = sequence.at(2);
  EXPECT_FALSE(body.trusted);
  EXPECT_LT(body_error(truth.faces, body.vertices, truth, {}).mean,
            0.4 * body_error(truth.faces, ball_frame(2).posed, truth, {}).mean);
}

TEST(UnderlyingSequence, NoScansAtAll_GiveThePersonalBody) {
  const Mesh truth = fixtures::ball(0.3, 3);
  const UnderlyingSequence sequence(truth.faces, 2,
                                    [](Index frame) { return ball_frame(frame, false); });
  EXPECT_EQ(sequence.at(1).vertices, ball_frame(1).posed);
}

TEST(UnderlyingSequence, FramesOutOfRange_AreRefused) {
  const Mesh truth = fixtures::ball(0.3, 3);
  const UnderlyingSequence sequence(truth.faces, 2,
                                    [](Index frame) { return ball_frame(frame, false); });
  ATELIER_EXPECT_REFUSED(sequence.at(2), LogicError, "no such frame");
  ATELIER_EXPECT_REFUSED(sequence.at(-1), LogicError, "no such frame");
  ATELIER_EXPECT_REFUSED(UnderlyingSequence(truth.faces, -1, {}), LogicError, "negative");
}

}  // namespace
}  // namespace atelier
