#include "pipeline/garment/simulated_prediction.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr double kSeconds = 0.1;

/// A sheet of 20 x 20 cm of which one corner's triangle is led and the rest hangs free, and a body
/// far away.
struct Sheet {
  Mesh mesh = fixtures::grid(9, 9);
  Mesh body = fixtures::sphere(1);
  std::vector<char> free;
  Points before, led;
  Eigen::VectorXd sure;

  Sheet() {
    mesh.vertices *= 0.2 / (mesh.vertices.maxCoeff() - mesh.vertices.minCoeff());
    body.vertices.col(1).array() -= 10;
    free.assign(static_cast<std::size_t>(mesh.vertices.rows()), 1);
    before = led = mesh.vertices;
    sure = Eigen::VectorXd::Ones(mesh.vertices.rows());
  }
  Points predicted() const {
    return simulated_prediction(mesh.faces, free, {0, 1, mesh.vertices, before, sure, led},
                                {body.faces, body.vertices, body.vertices}, kSeconds);
  }
};

const Eigen::RowVector3d kFall(0, -0.5 * 9.81 * kSeconds * kSeconds, 0);

/// Vertices far from the led one, which its pull does not reach at once.
Points far_from(const Sheet& sheet, int led, const Points& of) {
  std::vector<Index> rows;
  for (Index v = 0; v < of.rows(); ++v) {
    if ((sheet.mesh.vertices.row(v) - sheet.mesh.vertices.row(led)).norm() > 0.2) {
      rows.push_back(v);
    }
  }
  return of(rows, Eigen::all);
}

TEST(SimulatedPrediction, ClothThatFlies_GoesOnAndFalls) {
  Sheet sheet;
  sheet.free[0] = 0;
  const Eigen::RowVector3d way(0.03, 0.01, -0.02);  // in a frame
  sheet.before.rowwise() -= way;
  sheet.led.rowwise() += way + kFall;
  const Points end = sheet.predicted();
  ASSERT_EQ(end.rows(), sheet.mesh.vertices.rows());
  EXPECT_LT((far_from(sheet, 0, end - sheet.led)).rowwise().norm().maxCoeff(), 0.004);
  EXPECT_LT((end.row(0) - sheet.led.row(0)).norm(), 1e-6);
}

TEST(SimulatedPrediction, PlacesThatAreNotSure_TellNoSpeed) {
  Sheet sheet;
  sheet.free[0] = 0;
  sheet.before.rowwise() -= Eigen::RowVector3d(0.3, 0, 0);  // it was lost there
  sheet.sure.setZero();
  sheet.led.rowwise() += kFall;
  const Points end = sheet.predicted();
  ASSERT_EQ(end.rows(), sheet.mesh.vertices.rows());
  // The corner that is led pulls a little; a speed that was believed would take it 30 cm.
  EXPECT_LT((end - sheet.mesh.vertices).col(0).cwiseAbs().maxCoeff(), 0.02);
}

TEST(SimulatedPrediction, NothingFreeOrNoFrameBefore_SaysNothing) {
  Sheet sheet;
  EXPECT_EQ(sheet.predicted().rows(), 0);  // nothing leads it
  sheet.free.assign(sheet.free.size(), 0);
  EXPECT_EQ(sheet.predicted().rows(), 0);
  sheet.free[5] = 1;
  sheet.before.resize(0, 3);
  EXPECT_EQ(sheet.predicted().rows(), 0);
}

TEST(SimulatedPrediction, FaceWithoutArea_SaysNothing) {
  Sheet sheet;
  sheet.free[0] = 0;
  sheet.mesh.vertices.row(sheet.mesh.faces(0, 0)) = sheet.mesh.vertices.row(sheet.mesh.faces(0, 1));
  EXPECT_EQ(sheet.predicted().rows(), 0);
}

}  // namespace
}  // namespace atelier
