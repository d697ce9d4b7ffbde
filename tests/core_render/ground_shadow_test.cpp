// What cameras share: shadows on the ground, filtered textures, the squares that meshes touch.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/render/ground_shadows.h"
#include "core/render/occupied_tiles.h"
#include "core/render/prepared_scene.h"
#include "core/render/render.h"
#include "core/render/surface_maps.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using fixtures::look_at;
using fixtures::matt;
using fixtures::rectangle;
using fixtures::sphere;

/// A large soft box over seamless paper, and what hangs between them.
Scene under_a_soft_box(const Mesh& mesh) {
  Scene scene;
  scene.meshes.push_back({mesh, matt({0.5F, 0.5F, 0.5F})});
  AreaLight light;
  light.center = {0.5, 3, 0};
  light.half_u = {0.8, 0, 0};
  light.half_v = {0, 0, 0.8};
  light.radiance = {3, 2, 1};
  scene.area_lights.push_back(light);
  scene.environment = constant_environment({0.2F, 0.2F, 0.2F});
  scene.background.top = scene.background.bottom = {0.6F, 0.6F, 0.6F};
  scene.ground = Ground{};
  return scene;
}

constexpr PrepareOptions kShared = {
    .ambient = Ambient::None, .ground_shadow_rays = 256, .ground_shadow_reach = 2};

double rms(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    sum += std::pow(a.data[i] - b.data[i], 2);
  }
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

TEST(GroundShadows, SharedShadows_MatchManyRaysPerPixel) {
  const Scene scene = under_a_soft_box(sphere(24, 48, 0.3, {0, 0.5, 0}));
  const Camera camera = look_at({0, 2, 3}, {0, 0, 0}, 60, 40, 40);
  const Image truth = render(prepare(scene, {.ambient = Ambient::None}), camera,
                             {.samples = 64, .shadow_samples = 16, .penumbra_samples = 16});
  const Image own = render(prepare(scene, {.ambient = Ambient::None}), camera, {.samples = 4});
  const Image shared = render(prepare(scene, kShared), camera, {.samples = 4});
  EXPECT_LT(rms(shared, truth), 0.0075);
  EXPECT_LT(rms(shared, truth), rms(own, truth)) << "without the noise of few rays";
}

TEST(GroundShadows, SharpShadows_AreLeftToPixels) {
  // A tile that all but lies on the paper: its shadow is sharp, beside it there is none.
  const Scene scene = under_a_soft_box(rectangle({0.013, 0.01, 0}, {0.2, 0, 0}, {0, 0, -0.2}));
  const PreparedScene shared = prepare(scene, kShared);
  const GroundShadows& shadows = shared.data().ground_shadows;
  EXPECT_FALSE(shadows.at(0.213F, 0).has_value());
  const auto open = shadows.at(-1, 0.5F);
  ASSERT_TRUE(open.has_value());
  EXPECT_EQ(open->missing.x, 0);
  EXPECT_NEAR(open->open.x / open->open.z, 3, 1e-4);
  const auto under = shadows.at(0, 0);
  ASSERT_TRUE(under.has_value());
  EXPECT_NEAR(under->missing.y, under->open.y, 1e-4F * under->open.y);
  const Camera camera = look_at({0.3, 0.6, 0.8}, {0.2, 0, 0.1}, 40, 40, 60);
  const RenderOptions many{.samples = 64, .shadow_samples = 4};
  EXPECT_LT(rms(render(shared, camera, many),
                render(prepare(scene, {.ambient = Ambient::None}), camera, many)),
            0.004);
}

TEST(GroundShadows, Shadows_EndAtTheirReach) {
  const PreparedScene shared = prepare(under_a_soft_box(sphere(8, 16, 0.3, {0, 0.5, 0})), kShared);
  const GroundShadows& shadows = shared.data().ground_shadows;
  EXPECT_TRUE(shadows.at(1.95F, -1.95F).has_value());
  for (const auto& [x, z] : {std::pair{2.1F, 0.0F}, {-2.1F, 0.0F}, {0.0F, 2.1F}, {0.0F, -2.1F}}) {
    EXPECT_FALSE(shadows.at(x, z).has_value()) << x << " " << z;
  }
  EXPECT_FALSE(GroundShadows{}.at(0, 0).has_value());
}

TEST(GroundShadows, LowLightOrPlainGround_DisablesSharing) {
  Scene scene = under_a_soft_box(sphere(8, 16, 0.3, {0, 0.5, 0}));
  scene.area_lights[0].center.y() = 0.4;
  scene.area_lights[0].half_u = {0, 0.8, 0};
  EXPECT_TRUE(prepare(scene, kShared).data().ground_shadows.open.data.empty());
  scene = under_a_soft_box(sphere(8, 16, 0.3, {0, 0.5, 0}));
  scene.ground->seamless = false;
  EXPECT_TRUE(prepare(scene, kShared).data().ground_shadows.open.data.empty());
  scene.ground.reset();
  EXPECT_TRUE(prepare(scene, kShared).data().ground_shadows.open.data.empty());
}

TEST(GroundShadows, AnyThreadCount_GivesTheSameImage) {
  const Scene scene = under_a_soft_box(sphere(8, 16, 0.3, {0, 0.5, 0}));
  const Camera camera = look_at({0, 2, 3}, {0, 0, 0}, 60, 40, 40);
  set_thread_count(1);
  const Image one = render(prepare(scene, kShared), camera);
  set_thread_count(5);
  const Image five = render(prepare(scene, kShared), camera);
  set_thread_count(0);
  EXPECT_EQ(one.data, five.data);
}

TEST(GroundShadows, RaysOrReachOutOfRange_AreRefused) {
  const Scene scene = under_a_soft_box(sphere(8, 16, 0.3, {0, 0.5, 0}));
  for (const int rays : {-1, 1025}) {
    EXPECT_THROW(prepare(scene, {.ground_shadow_rays = rays}), LogicError) << rays;
  }
  for (const double reach : {0.5, 51.0, std::nan("")}) {
    EXPECT_THROW(prepare(scene, {.ground_shadow_rays = 4, .ground_shadow_reach = reach}),
                 LogicError)
        << reach;
  }
}

TEST(PreparedTextures, PreparedTextures_DoNotChangeTheImage) {
  Random random{7, 0};
  auto texture = std::make_shared<Image>(13, 9, 3);
  for (float& value : texture->data) {
    value = static_cast<float>(uniform(random));
  }
  Scene scene = under_a_soft_box(sphere(16, 32, 0.5, {0, 0.6, 0}));
  scene.meshes[0].look.texture = texture;
  const PreparedTextures textures = prepare_textures(std::vector<Look>(1, scene.meshes[0].look));
  const Camera camera = look_at({0, 1, 3}, {0, 0.5, 0}, 30, 30, 40);
  const PreparedScene with = prepare(scene, {}, textures);
  EXPECT_EQ(render(with, camera).data, render(prepare(scene), camera).data);
  EXPECT_EQ(with.data().meshes[0].texture, textures.data()->textures.at(texture.get()).pyramid);
}

TEST(PreparedTextures, BadTextureImage_IsRefused) {
  Look look;
  look.texture = std::make_shared<const Image>();
  EXPECT_THROW(prepare_textures(std::vector<Look>(1, look)), LogicError);
  look.texture = std::make_shared<const Image>(4, 4, 1);
  EXPECT_THROW(prepare_textures(std::vector<Look>(1, look)), LogicError);
}

TEST(SurfaceMaps, MeshesBeyondTheFirst_OnlyOcclude) {
  Scene scene;
  scene.meshes.push_back({sphere(16, 32, 0.5), matt({1, 1, 1})});
  scene.meshes.push_back({rectangle({0.5, 0, 1}, {0.5, 0, 0}, {0, 1, 0}), matt({1, 1, 1})});
  const PreparedScene prepared = prepare(scene);
  Camera camera = look_at({0, 0, 4}, {0, 0, 0}, 61, 43, 60);
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.08, 0.03, 0, 0, 0, 0, 0, 0};
  const SurfaceMaps all = surface_maps(prepared, camera);
  const SurfaceMaps first = surface_maps(prepared, camera, 1);
  int hidden = 0;
  int seen = 0;
  for (std::size_t p = 0; p < all.mesh.data.size(); ++p) {
    EXPECT_EQ(first.mesh.data[p], all.mesh.data[p] == 0 ? 0 : -1);
    EXPECT_EQ(first.depth.data[p], all.mesh.data[p] == 0 ? all.depth.data[p] : 0);
    hidden += all.mesh.data[p] == 1 ? 1 : 0;
    seen += all.mesh.data[p] == 0 ? 1 : 0;
  }
  EXPECT_GT(hidden, 100);
  EXPECT_GT(seen, 50);
}

TEST(OccupiedTiles, OccupiedTiles_CoverEveryVisiblePoint) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random{seed, 0};
    const auto anywhere = [&](double size) {
      return Eigen::Vector3d(uniform(random, -size, size), uniform(random, -size, size),
                             uniform(random, -size, size));
    };
    Scene scene;
    for (int i = 0; i < 4; ++i) {
      scene.meshes.push_back({rectangle(anywhere(2), anywhere(0.3), anywhere(0.3)), Look{}});
      scene.meshes.back().look.smooth = false;
    }
    Camera camera = look_at(anywhere(0.5) + Eigen::Vector3d(0, 0, 1.5), anywhere(0.3), 96, 64, 70);
    camera.distortion_model = Distortion::Brown;
    camera.distortion = {-0.1, 0.02, 0.001, -0.001, 0, 0, 0, 0};
    const PreparedScene prepared = prepare(scene);
    const OccupiedTiles tiles = occupied_tiles(prepared.data(), camera, 8, 4);
    ASSERT_EQ(tiles.columns, 12);
    ASSERT_EQ(tiles.rows, 8);
    // Without tiles: points of each face, projected.
    for (const RenderMesh& mesh : scene.meshes) {
      for (Index f = 0; f < mesh.mesh.faces.rows(); ++f) {
        for (int k = 0; k < 400; ++k) {
          double u = uniform(random);
          double v = uniform(random);
          if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
          }
          const Eigen::RowVector3d p = (1 - u - v) * mesh.mesh.vertices.row(mesh.mesh.faces(f, 0)) +
                                       u * mesh.mesh.vertices.row(mesh.mesh.faces(f, 1)) +
                                       v * mesh.mesh.vertices.row(mesh.mesh.faces(f, 2));
          const auto pixel = project(camera, p.transpose());
          if (pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < 96 && pixel->y() < 64) {
            EXPECT_TRUE(
                tiles.at(static_cast<int>(pixel->x()) / 8, static_cast<int>(pixel->y()) / 8))
                << seed;
          }
        }
      }
    }
  }
}

TEST(OccupiedTiles, MeshesOutOfView_OccupyNoTile) {
  Scene scene;
  scene.meshes.push_back({sphere(8, 16, 0.2), Look{}});
  // A post through the plane of the camera, out of its sight.
  scene.meshes.push_back({rectangle({0, -2, 3.5}, {0.05, 0, 0}, {0, 0, 2}), Look{}});
  scene.meshes.push_back({sphere(8, 16, 0.2, {0, 0, 5}), Look{}});
  const Camera camera = look_at({0, 0, 4}, {0, 0, 0}, 64, 64, 80);
  const OccupiedTiles tiles = occupied_tiles(prepare(scene).data(), camera, 8, 3);
  EXPECT_TRUE(tiles.at(3, 3));
  EXPECT_FALSE(tiles.at(0, 0));
  EXPECT_FALSE(tiles.at(4, 7));
}

}  // namespace
}  // namespace atelier
