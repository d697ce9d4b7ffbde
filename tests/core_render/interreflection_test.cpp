// One bounce of light between meshes: against form factors, against none, and what is refused.
#include "core/render/interreflection.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/prepared_scene.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

constexpr float kPi = std::numbers::pi_v<float>;

/// A square of `cells` x `cells` in the plane x = 0, looking to +X.
RenderMesh wall(int cells, double side, const Eigen::Vector3f& color) {
  RenderMesh wall;
  const int n = cells + 1;
  wall.mesh.vertices.resize(n * n, 3);
  wall.mesh.faces.resize(2 * cells * cells, 3);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      wall.mesh.vertices.row(j * n + i) << 0, side * (static_cast<double>(j) / cells - 0.5),
          side * (0.5 - static_cast<double>(i) / cells);
    }
  }
  Index f = 0;
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * n + i;
      wall.mesh.faces.row(f++) << a, a + 1, a + n + 1;
      wall.mesh.faces.row(f++) << a, a + n + 1, a + n;
    }
  }
  wall.look.color = color;
  return wall;
}

/// A speck just before the wall's middle that looks up.
RenderMesh speck() {
  RenderMesh speck;
  speck.mesh.vertices.resize(3, 3);
  speck.mesh.vertices << 0.005, 0, 0, 0.006, 0, 0, 0.006, 0, -0.001;
  speck.mesh.faces.resize(1, 3);
  speck.mesh.faces << 0, 1, 2;
  speck.look.color = {0.5F, 0.5F, 0.5F};
  return speck;
}

PrepareOptions per_vertex() {
  return {.ambient = Ambient::PerVertex, .vertex_samples = 1024};
}

TEST(Interreflection, WallBesideSurface_AddsHalfItsReflectance) {
  // The wall fills half of the speck's sky, weighted by the cosine: its form factor is 1/2.
  Scene scene;
  scene.environment = constant_environment({1, 1, 1});
  scene.meshes = {wall(4, 8, {0.8F, 0.4F, 0.2F}), speck()};
  const PreparedScene prepared = prepare_with_bounce(scene, per_vertex(), {.rays = 1024});
  for (const Vec3f& e : prepared.data().meshes[1].front_irradiance) {
    EXPECT_NEAR(e.x, kPi * (0.5F + 0.5F * 0.8F), 0.02F * kPi);
    EXPECT_NEAR(e.y, kPi * (0.5F + 0.5F * 0.4F), 0.02F * kPi);
    EXPECT_NEAR(e.z, kPi * (0.5F + 0.5F * 0.2F), 0.02F * kPi);
  }
}

TEST(Interreflection, AreaLight_IsReflectedAndShadowed) {
  Scene scene;
  scene.environment = constant_environment({0.01F, 0.01F, 0.01F});
  scene.meshes = {wall(16, 8, {0.5F, 0.5F, 0.5F}), speck()};
  AreaLight lamp;
  lamp.center = {6, 0, 0};
  lamp.half_u = {0, 0, -2};
  lamp.half_v = {0, -2, 0};
  lamp.radiance = {10, 10, 10};
  const Eigen::Vector3d shines = lamp.half_u.cross(lamp.half_v);
  if (shines.x() > 0) {
    lamp.half_v = -lamp.half_v;
  }
  scene.area_lights = {lamp};
  const PreparedScene with = prepare_with_bounce(scene, per_vertex(), {.rays = 1024});
  const PreparedScene without = prepare(scene, per_vertex());
  const float on_wall = kPi * 10 * form_factor(rectangle_light(lamp), {0, 0, 0}, {1, 0, 0}).value;
  ASSERT_GT(on_wall, 1);
  const float bounced =
      with.data().meshes[1].front_irradiance[0].x - without.data().meshes[1].front_irradiance[0].x;
  EXPECT_NEAR(bounced, 0.5F * 0.5F * on_wall, 0.03F * on_wall);

  // In the wall's shadow there is nothing to throw on.
  RenderMesh screen = wall(1, 20, {0, 0, 0});
  screen.mesh.vertices.col(0).array() += 1;
  scene.meshes.push_back(screen);
  const PreparedScene shaded = prepare_with_bounce(scene, per_vertex(), {.rays = 256});
  EXPECT_LT(shaded.data().meshes[1].front_irradiance[0].x, 0.05F);
}

TEST(Interreflection, ConvexMeshAlone_GetsNone) {
  Scene scene;
  scene.environment = constant_environment({1, 1, 1});
  scene.meshes = {wall(4, 1, {0.9F, 0.9F, 0.9F})};
  const PreparedScene with = prepare_with_bounce(scene, per_vertex());
  const PreparedScene without = prepare(scene, per_vertex());
  const auto& a = with.data().meshes[0].front_irradiance;
  const auto& b = without.data().meshes[0].front_irradiance;
  for (std::size_t v = 0; v < a.size(); ++v) {
    EXPECT_EQ(a[v].x, b[v].x);
  }
}

TEST(Interreflection, UnsupportedOptions_AreRefused) {
  const auto said = [](const PrepareOptions& options, const BounceOptions& bounce) {
    try {
      prepare_with_bounce({}, options, bounce);
    } catch (const LogicError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(said({}, {}), HasSubstr("PerVertex"));
  EXPECT_THAT(said(per_vertex(), {.rays = 0}), HasSubstr("rays must lie"));
  EXPECT_THAT(said(per_vertex(), {.light_rays = 300}), HasSubstr("light_rays must lie"));
  EXPECT_THAT(said(per_vertex(), {.smoothings = -1}), HasSubstr("smoothings must lie"));
}

}  // namespace
}  // namespace atelier
