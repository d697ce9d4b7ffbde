#include <gtest/gtest.h>

#include "tests/bodymodel/makehuman_adult.h"
#include "tests/bodymodel/surface_fit.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

enum Region { TrunkAndLimbs, Head, Hand, Foot, Regions };

Region region_of(const BodyModel& model, Index vertex) {
  Index slot = 0;
  model.skin.weights.row(vertex).maxCoeff(&slot);
  const std::string& name = model.skeleton.names[model.skin.joints(vertex, slot)];
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  if (name == "head" || name == "jaw" || has("eye")) {
    return Head;
  }
  if (has("wrist") || has("thumb") || has("index") || has("middle") || has("ring") ||
      has("pinky")) {
    return Hand;
  }
  return has("ankle") || has("foot") ? Foot : TrunkAndLimbs;
}

struct Agreement {
  double forward[Regions] = {};   ///< mean distance of our skin from theirs, metres
  double backward[Regions] = {};  ///< of their outer skin from ours
  double normals = 0;             ///< share of our area with normals within 20 degrees
};

Agreement agreement(const fixtures::SurfaceFit& fit, const Mesh& target) {
  Agreement result;
  const Triangles& faces = fit.model.mesh.faces;
  const TriangleTree theirs = build_tree(target.vertices, target.faces);
  const TriangleTree ours = build_tree(fit.vertices, faces);
  const Points their_normals = vertex_normals(target.vertices, target.faces);
  const Points normals = vertex_normals(fit.vertices, faces);
  const Eigen::VectorXd areas = vertex_areas(fit.vertices, faces);
  double total[Regions] = {};
  const auto closest = closest_points(theirs, fit.vertices);
  for (Index v = 0; v < fit.vertices.rows(); ++v) {
    const Region r = region_of(fit.model, v);
    result.forward[r] += areas[v] * std::sqrt(closest[v].squared_distance);
    total[r] += areas[v];
    // Smooth normals on both sides: flat ones of large quads would measure their size.
    Eigen::RowVector3d normal = Eigen::RowVector3d::Zero();
    for (int c = 0; c < 3; ++c) {
      normal += closest[v].barycentric[c] * their_normals.row(target.faces(closest[v].face, c));
    }
    if (normal.normalized().dot(normals.row(v)) > std::cos(20 * M_PI / 180)) {
      result.normals += areas[v];
    }
  }
  double sum = 0;
  for (int r = 0; r < Regions; ++r) {
    result.forward[r] /= total[r];
    sum += total[r];
    total[r] = 0;
  }
  result.normals /= sum;
  const Eigen::VectorXd their_areas = vertex_areas(target.vertices, target.faces);
  const auto back = closest_points(ours, target.vertices);
  for (Index v = 0; v < target.vertices.rows(); ++v) {
    const Region r = region_of(fit.model, faces(back[v].face, 0));
    Ray ray;
    ray.direction = their_normals.row(v);
    ray.origin = target.vertices.row(v).transpose() + 1e-3 * ray.direction;
    ray.t_max = 0.05;
    if (r == Head && any_hit(theirs, ray)) {
      continue;  // inside of mouth, nose and eye sockets
    }
    result.backward[r] += their_areas[v] * std::sqrt(back[v].squared_distance);
    total[r] += their_areas[v];
  }
  for (int r = 0; r < Regions; ++r) {
    result.backward[r] /= total[r];
  }
  return result;
}

void expect_near_makehuman(bool male, double stature) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const fixtures::MakeHumanAdult adult =
      fixtures::makehuman_adult(base.parent_path().parent_path(), male);
  DefaultHumanOptions options = male ? male_human() : female_human();
  options.stature = stature;
  const fixtures::SurfaceFit fit = fixtures::fit_default_human(adult.mesh, adult.joints, options);
  const Agreement a = agreement(fit, adult.mesh);
  const double limits[Regions] = {0.008, 0.012, 0.015, 0.015};
  const char* names[Regions] = {"trunk and limbs", "head", "hands", "feet"};
  for (int r = 0; r < Regions; ++r) {
    std::printf("%s %s: ours to theirs %.2f mm, theirs to ours %.2f mm\n", male ? "male" : "female",
                names[r], 1e3 * a.forward[r], 1e3 * a.backward[r]);
    EXPECT_LT(a.forward[r], limits[r]) << names[r];
    EXPECT_LT(a.backward[r], limits[r]) << names[r];
  }
  std::printf("normals within 20 degrees: %.1f%%\n", 100 * a.normals);
  EXPECT_GT(a.normals, 0.90);
}

TEST(DefaultHumanMakeHuman, FemaleMakeHuman_IsNearTheDefaultHuman) {
  expect_near_makehuman(false, 1.59);
}

TEST(DefaultHumanMakeHuman, MaleMakeHuman_IsNearTheDefaultHuman) {
  expect_near_makehuman(true, 1.73);
}

}  // namespace
}  // namespace atelier
