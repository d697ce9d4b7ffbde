// The image: edges, textures, lens, background, alpha, looks, determinism.

#include "core/render/render.h"

#include <gtest/gtest.h>

#include "core/parallel.h"
#include "core/random.h"
#include "core/render/mip_pyramid.h"
#include "core/render/studio.h"
#include "core/render/surface_maps.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using fixtures::color_at;
using fixtures::look_at;
using fixtures::matt;
using fixtures::rectangle;
using fixtures::sphere;

// Under constant light of 1 a flat matt surface shows its reflectance.
Scene bright(const Mesh& mesh, const Look& look) {
  Scene scene;
  scene.meshes.push_back({mesh, look});
  scene.environment = constant_environment({1, 1, 1});
  return scene;
}

TEST(Render, EmptyScene_IsTheBackground) {
  Scene scene;
  scene.background.top = {1, 0, 0.5f};
  scene.background.bottom = {0, 1, 0.5f};
  const Image image = render(scene, look_at({0, 1, 3}, {0, 1, 0}, 20, 40, 40));
  for (int y = 0; y < 40; ++y) {
    const float t = (static_cast<float>(y) + 0.5f) / 40;
    EXPECT_NEAR(image.at(7, y, 0), 1 - t, 1e-6);
    EXPECT_NEAR(image.at(7, y, 1), t, 1e-6);
    EXPECT_NEAR(image.at(7, y, 2), 0.5, 1e-6);
  }
}

TEST(Render, EnvironmentBackground_ShowsTheSky) {
  Scene scene;
  scene.environment.zenith = {1, 0, 0};
  scene.environment.horizon = {0, 1, 0};
  scene.background.kind = Background::Kind::Environment;
  const Image up = render(scene, look_at({0, 0, 0}, {0, 1, 0.001}, 3, 3, 1000));
  EXPECT_NEAR(up.at(1, 1, 0), 1, 1e-3);
  const Image level = render(scene, look_at({0, 0, 0}, {1, 0, 0}, 3, 3, 1000));
  EXPECT_NEAR(level.at(1, 1, 1), 1, 1e-2);
}

TEST(Render, EmptySeamlessGround_IsTheBackground) {
  Scene with_ground;
  with_ground.background.top = with_ground.background.bottom = {0.3f, 0.4f, 0.5f};
  with_ground.environment = constant_environment({1, 1, 1});
  with_ground.ground = Ground{};
  with_ground.area_lights.push_back({});
  const Image image = render(with_ground, look_at({0, 1, 3}, {0, 0, 0}, 16, 16, 10));
  for (int y = 0; y < 16; ++y) {
    EXPECT_NEAR(image.at(8, y, 0), 0.3, 1e-5);
    EXPECT_NEAR(image.at(8, y, 2), 0.5, 1e-5);
  }
}

TEST(Render, PlainGround_HasAHorizon) {
  Scene scene;
  scene.background.top = scene.background.bottom = {0, 0, 1};
  scene.environment = constant_environment({1, 1, 1});
  scene.ground = Ground{0, {0.25f, 0.25f, 0.25f}, false};
  const Image image = render(scene, look_at({0, 1, 0}, {0, 1, -1}, 8, 8, 8));
  EXPECT_NEAR(image.at(4, 0, 2), 1, 1e-6);
  EXPECT_NEAR(image.at(4, 0, 0), 0, 1e-6);
  EXPECT_NEAR(image.at(4, 7, 0), 0.25, 1e-4);
}

TEST(Render, EdgeCoverage_EqualsTheArea) {
  // A square turned by 20 degrees, 37 pixels a side.
  const double c = std::cos(0.35), s = std::sin(0.35);
  const double half = 18.5 / 64;
  const Scene scene = bright(
      rectangle({0, 0, 0}, {half * c, half * s, 0}, {-half * s, half * c, 0}), matt({1, 1, 1}));
  const Camera camera = look_at({0, 0, 10}, {0, 0, 0}, 64, 64, 640);
  const Image image = render(scene, camera, {.samples = 32, .ambient_samples = 1, .alpha = true});
  double area = 0;
  int partial = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const float alpha = image.at(x, y, 3);
      area += alpha;
      partial += alpha > 0.01f && alpha < 0.99f ? 1 : 0;
      EXPECT_NEAR(image.at(x, y, 0), alpha, 1e-3) << "premultiplied";
    }
  }
  EXPECT_NEAR(area, 37.0 * 37.0, 1.5);
  EXPECT_GT(partial, 120) << "edges are smooth";
}

TEST(Render, HalfCoveredPixel_HasHalfAlpha) {
  // The edge runs through the middle of a column of pixels.
  const Scene scene =
      bright(rectangle({-1 + 0.5 / 32, 0, 0}, {1, 0, 0}, {0, 2, 0}), matt({1, 1, 1}));
  const Image image = render(scene, look_at({0, 0, 10}, {0, 0, 0}, 32, 32, 320),
                             {.samples = 16, .ambient_samples = 1, .alpha = true});
  for (int y = 4; y < 28; ++y) {
    EXPECT_NEAR(image.at(16, y, 3), 0.5, 1.0 / 16 + 1e-6);
    EXPECT_EQ(image.at(15, y, 3), 1);
    EXPECT_EQ(image.at(17, y, 3), 0);
  }
}

TEST(Render, ShadowOnSeamlessGround_HasBlackAlpha) {
  Scene scene = bright(sphere(24, 48, 0.5, {0, 0.5, 0}), matt({0.5f, 0.5f, 0.5f}));
  scene.ground = Ground{};
  const Image image =
      render(scene, look_at({0, 1.5, 4}, {0, 0.4, 0}, 32, 32, 40), {.samples = 8, .alpha = true});
  EXPECT_EQ(image.channels, 4);
  EXPECT_EQ(image.at(16, 14, 3), 1) << "on the sphere";
  EXPECT_GT(image.at(16, 22, 3), 0.1f) << "under it";
  EXPECT_LT(image.at(16, 22, 3), 0.99f);
  EXPECT_EQ(image.at(16, 22, 0), 0) << "a shadow is black";
  EXPECT_EQ(image.at(1, 1, 3), 0);
}

std::shared_ptr<Image> random_texture(int width, int height) {
  auto texture = std::make_shared<Image>(width, height, 3);
  Random random{3, 0};
  for (float& value : texture->data) {
    value = static_cast<float>(uniform(random));
  }
  return texture;
}

TEST(Texture, Texel_AppearsAtItsUv) {
  const auto texture = random_texture(4, 3);
  Look look = matt({1, 1, 1});
  look.texture = texture;
  const Scene scene = bright(rectangle({0, 0, 0}, {2, 0, 0}, {0, 1.5, 0}), look);
  // 100 pixels a texel; the middle of texel (i, j) is at pixel (100 i + 50, 100 j + 50).
  const Image image = render(scene, look_at({0, 0, 100}, {0, 0, 0}, 400, 300, 10'000),
                             {.samples = 1, .ambient_samples = 1});
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 4; ++i) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(image.at(100 * i + 50, 100 * j + 50, c), texture->at(i, j, c), 0.02) << i << j;
      }
    }
  }
}

TEST(Texture, Lookup_IsBilinearAndRepeats) {
  const auto texture = random_texture(5, 4);
  const MipPyramid pyramid = mip_pyramid(*texture);
  const Vec3f a = texture_color(pyramid, 1.5f / 5, 1 - 2.5f / 4, 0);
  EXPECT_NEAR(a.x, texture->at(1, 2, 0), 1e-6);
  const Vec3f between = texture_color(pyramid, 2.0f / 5, 1 - 2.5f / 4, 0);
  EXPECT_NEAR(between.y, 0.5 * (texture->at(1, 2, 1) + texture->at(2, 2, 1)), 1e-5);
  const Vec3f wrapped = texture_color(pyramid, 1.5f / 5 - 7, 1 - 2.5f / 4 + 3, 0);
  EXPECT_NEAR(wrapped.x, a.x, 1e-4);
  const Vec3f seam = texture_color(pyramid, 0, 1 - 0.5f / 4, 0);
  EXPECT_NEAR(seam.z, 0.5 * (texture->at(0, 0, 2) + texture->at(4, 0, 2)), 1e-5);
}

TEST(Texture, MipLevels_KeepTheMean) {
  const auto texture = random_texture(37, 21);
  const MipPyramid pyramid = mip_pyramid(*texture);
  double mean = 0;
  for (std::size_t i = 0; i < texture->data.size(); i += 3) {
    mean += texture->data[i];
  }
  mean /= 37.0 * 21.0;
  EXPECT_EQ(pyramid.levels.back().width, 1);
  EXPECT_EQ(pyramid.levels.back().height, 1);
  EXPECT_NEAR(pyramid.levels.back().at(0, 0, 0), mean, 1e-4);
  EXPECT_NEAR(texture_color(pyramid, 0.3f, 0.8f, 1e6f).x, mean, 1e-4);
}

TEST(Texture, DistantTexture_IsFilteredToItsMean) {
  auto texture = std::make_shared<Image>(256, 256, 3);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      for (int c = 0; c < 3; ++c) {
        texture->at(x, y, c) = (x + y) % 2 == 0 ? 1.0f : 0.0f;
      }
    }
  }
  Look look = matt({1, 1, 1});
  look.texture = texture;
  const Scene scene = bright(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), look);
  const Image image = render(scene, look_at({0, 0, 10}, {0, 0, 0}, 16, 16, 80),
                             {.samples = 4, .ambient_samples = 1});
  for (int y = 2; y < 14; ++y) {
    EXPECT_NEAR(image.at(8, y), 0.5, 0.02);
  }
}

TEST(Look, VertexColors_AreInterpolatedAndMultiplied) {
  Mesh mesh = rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.colors.resize(4, 3);
  mesh.colors << 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1;
  const Camera camera = look_at({0, 0, 10}, {0, 0, 0}, 32, 32, 160);
  const Image image = render(bright(mesh, matt({0.5f, 0.5f, 0.5f})), camera);
  EXPECT_NEAR(image.at(24, 8, 0), 0.5 * 24.5 / 32, 0.01);
  EXPECT_NEAR(image.at(24, 8, 1), 0.5 * (1 - 8.5 / 32), 0.01);
  EXPECT_NEAR(image.at(24, 8, 2), 0.5, 0.01);
  Look plain = matt({0.5f, 0.5f, 0.5f});
  plain.vertex_colors = false;
  EXPECT_NEAR(render(bright(mesh, plain), camera).at(24, 8, 0), 0.5, 0.01);
}

TEST(Look, BackColor_ShowsOnlyOnTheBack) {
  Look look = matt({0.8f, 0.2f, 0.2f});
  const Mesh mesh = rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const Camera back = look_at({0, 0, -10}, {0, 0, 0}, 8, 8, 100);
  EXPECT_NEAR(render(bright(mesh, look), back).at(4, 4), 0.8, 0.01);
  look.back_color = Eigen::Vector3f(0.1f, 0.3f, 0.7f);
  const Image image = render(bright(mesh, look), back);
  EXPECT_NEAR(image.at(4, 4, 2), 0.7, 0.01);
  EXPECT_NEAR(render(bright(mesh, look), look_at({0, 0, 10}, {0, 0, 0}, 8, 8, 100)).at(4, 4), 0.8,
              0.01);
}

TEST(Look, Edges_HaveRequestedWidth) {
  Look look = matt({1, 1, 1});
  look.edge_color = Eigen::Vector3f(0, 0, 0);
  look.edge_width = 4;
  const Scene scene = bright(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), look);
  const Image image = render(scene, look_at({0, 0, 10}, {0, 0, 0}, 128, 128, 500), {.samples = 16});
  // The rim: half of the line lies on the face. 28 pixels inside the picture's border.
  double dark = 0;
  for (int x = 0; x < 64; ++x) {
    dark += x >= 14 ? 1 - image.at(x, 40) : 0;
  }
  // The diagonal crosses row 40 once more beyond x = 64 or before; here it lies at x = 128 - 40.
  EXPECT_NEAR(dark, 2, 0.3);
}

TEST(Look, SmoothNormals_HideFacets) {
  const Mesh coarse = sphere(8, 16);
  Look look = matt({1, 1, 1});
  Scene scene;
  scene.area_lights.push_back({{0, 0, 30}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}});
  scene.area_lights.back().half_v = {0, -1, 0};
  scene.meshes.push_back({coarse, look});
  const Camera camera = look_at({0, 0, 10}, {0, 0, 0}, 64, 64, 250);
  const auto roughest = [&](bool smooth) {
    scene.meshes[0].look.smooth = smooth;
    const Image image = render(scene, camera, {.samples = 16});
    const float middle = image.at(32, 32);
    float jump = 0;
    for (int x = 20; x < 44; ++x) {
      jump = std::max(jump, std::abs(image.at(x + 1, 25) - image.at(x, 25)));
    }
    return jump / middle;
  };
  EXPECT_GT(roughest(false), 2 * roughest(true));
}

// Rays leave through the lens as projection enters it.
TEST(Lens, SeenPoints_ProjectOntoTheirPixels) {
  Scene scene = bright(rectangle({0, 0, 0}, {3, 0, 0}, {0, 3, 0}), matt({1, 1, 1}));
  const PreparedScene prepared = prepare(scene);
  Camera camera = look_at({0.3, -0.2, 2}, {0, 0, 0}, 80, 60, 60);
  for (const auto& [model, coefficients] :
       {std::pair{Distortion::Brown, std::array<double, 8>{-0.2, 0.05, 0.003, -0.002, 0.01}},
        std::pair{Distortion::Fisheye, std::array<double, 8>{0.05, -0.01, 0.002, 0}},
        std::pair{Distortion::None, std::array<double, 8>{}}}) {
    camera.distortion_model = model;
    camera.distortion = coefficients;
    const SurfaceMaps maps = surface_maps(prepared, camera);
    int seen = 0;
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 80; ++x) {
        if (maps.mesh.at(x, y) < 0) {
          continue;
        }
        ++seen;
        const Eigen::Vector3d p(maps.position.at(x, y, 0), maps.position.at(x, y, 1),
                                maps.position.at(x, y, 2));
        const auto pixel = project(camera, p);
        ASSERT_TRUE(pixel);
        EXPECT_NEAR(pixel->x(), x + 0.5, 1e-3);
        EXPECT_NEAR(pixel->y(), y + 0.5, 1e-3);
      }
    }
    EXPECT_GT(seen, 3000);
  }
}

TEST(Lens, DistortedSquare_CoversItsProjectedPixels) {
  Camera camera = look_at({0, 0, 2}, {0, 0, 0}, 200, 160, 150);
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.25, 0.06, 0.004, -0.003, 0, 0, 0, 0};
  constexpr double kHalf = 0.05;
  constexpr int kN = 400;
  for (const Eigen::Vector3d& center : {Eigen::Vector3d(0.9, 0.7, 0), Eigen::Vector3d(-1.0, 0.3, 0),
                                        Eigen::Vector3d(0.1, -0.8, 0)}) {
    const Scene scene = bright(rectangle(center, {kHalf, 0, 0}, {0, kHalf, 0}), matt({1, 1, 1}));
    const Image image = render(scene, camera, {.samples = 64, .ambient_samples = 1, .alpha = true});
    // Each small cell of the square covers the area that the projection's derivative says.
    Image expected(200, 160, 1);
    for (int i = 0; i < kN; ++i) {
      for (int j = 0; j < kN; ++j) {
        const Eigen::Vector3d p =
            center + kHalf * Eigen::Vector3d((2 * i + 1.0) / kN - 1, (2 * j + 1.0) / kN - 1, 0);
        const auto pixel = project(camera, p);
        const auto jacobian = project_jacobian(camera, p);
        ASSERT_TRUE(pixel && jacobian);
        const double cell = 2 * kHalf / kN;
        const double area = std::abs((*jacobian)(0, 0) * (*jacobian)(1, 1) -
                                     (*jacobian)(0, 1) * (*jacobian)(1, 0)) *
                            cell * cell;
        expected.at(static_cast<int>(pixel->x()), static_cast<int>(pixel->y())) +=
            static_cast<float>(area);
      }
    }
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 200; ++x) {
        EXPECT_NEAR(image.at(x, y, 3), expected.at(x, y), 0.04) << x << " " << y;
      }
    }
  }
}

TEST(Lens, PixelsWithoutRay_AreBlack) {
  // A barrel so strong that the corners have no ray.
  Camera camera = look_at({0, 0, 2}, {0, 0, 0}, 64, 64, 20);
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.3, 0, 0, 0, 0, 0, 0, 0};
  ASSERT_FALSE(ray_direction(camera, {0.5, 0.5}));
  Scene scene;
  scene.background.top = scene.background.bottom = {1, 1, 1};
  const Image image = render(scene, camera);
  EXPECT_EQ(image.at(0, 0), 0);
  EXPECT_EQ(image.at(32, 32), 1);
}

TEST(Determinism, AnyThreadCount_GivesTheSameImages) {
  Scene scene =
      studio_scene({{sphere(24, 48, 0.4, {0, 0.4, 0}), clay_look()},
                    {rectangle({0.2, 0.9, 0.2}, {0.3, 0, 0}, {0, 0.02, -0.3}), clay_look()}});
  auto sky = std::make_shared<Image>(32, 16, 3, 0.3f);
  sky->at(5, 3, 1) = 40;
  scene.environment.image = sky;
  Camera camera = look_at({0.5, 1, 3}, {0, 0.5, 0}, 44, 36, 40);
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.1, 0.01, 0, 0, 0, 0, 0, 0};
  std::vector<Image> pixels, vertices;
  std::vector<SurfaceMaps> maps;
  for (const int threads : {1, 2, 7}) {
    set_thread_count(threads);
    pixels.push_back(render(prepare(scene), camera, {.ambient_samples = 4}));
    const PreparedScene baked =
        prepare(scene, {.ambient = Ambient::PerVertex, .vertex_samples = 32});
    vertices.push_back(render(baked, camera));
    maps.push_back(surface_maps(baked, camera));
  }
  set_thread_count(0);
  for (std::size_t i = 1; i < pixels.size(); ++i) {
    EXPECT_EQ(pixels[i].data, pixels[0].data);
    EXPECT_EQ(vertices[i].data, vertices[0].data);
    EXPECT_EQ(maps[i].face.data, maps[0].face.data);
    EXPECT_EQ(maps[i].depth.data, maps[0].depth.data);
  }
}

TEST(Determinism, DifferentSeeds_ChangeNoiseNotLight) {
  const Scene scene = studio_scene({{sphere(24, 48, 0.4, {0, 0.4, 0}), clay_look()}});
  const PreparedScene prepared = prepare(scene);
  const Camera camera = look_at({0.5, 1, 3}, {0, 0.4, 0}, 40, 40, 60);
  const Image a = render(prepared, camera, {.seed = 1});
  const Image b = render(prepared, camera, {.seed = 2});
  EXPECT_NE(a.data, b.data);
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    difference += a.data[i] - b.data[i];
    sum += a.data[i];
  }
  EXPECT_LT(std::abs(difference / sum), 2e-3);
}

TEST(Render, MoreSamples_ChangeOnlyTheNoise) {
  const Scene scene = studio_scene({{sphere(24, 48, 0.4, {0, 0.4, 0}), clay_look()}});
  const PreparedScene prepared = prepare(scene);
  const Camera camera = look_at({0.5, 1, 3}, {0, 0.4, 0}, 40, 40, 60);
  const Image few = render(prepared, camera, {.samples = 4, .ambient_samples = 4});
  const Image many = render(prepared, camera, {.samples = 64, .ambient_samples = 8});
  double squares = 0;
  for (std::size_t i = 0; i < few.data.size(); ++i) {
    const double d = few.data[i] - many.data[i];
    squares += d * d;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(few.data.size())), 0.03);
}

TEST(Maps, SphereDepthAndNormals_AreAnalytic) {
  Scene scene;
  scene.meshes.push_back({sphere(128, 256), matt({1, 1, 1})});
  const Camera camera = look_at({0, 0, 4}, {0, 0, 0}, 41, 41, 60);
  const SurfaceMaps maps = surface_maps(prepare(scene), camera);
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) {
      const Eigen::Vector3d d((x - 20.0) / 60, (20.0 - y) / 60, -1);  // z step 1: t is the depth
      const double a = d.squaredNorm(), b = -4.0, c = 15;             // |(0,0,4) + t d|^2 = 1
      const double disc = b * b - a * c;
      if (disc > 0.05) {
        const double t = (-b - std::sqrt(disc)) / a;
        ASSERT_EQ(maps.mesh.at(x, y), 0) << x << " " << y;
        EXPECT_NEAR(maps.depth.at(x, y), t, 2e-3) << x << " " << y;
        const Eigen::Vector3d n = Eigen::Vector3d(0, 0, 4) + t * d;
        EXPECT_NEAR(maps.normal.at(x, y, 0), n.x(), 0.02);
        EXPECT_NEAR(maps.normal.at(x, y, 1), n.y(), 0.02);
      } else if (disc < 0) {
        EXPECT_EQ(maps.mesh.at(x, y), -1);
        EXPECT_EQ(maps.depth.at(x, y), 0);
      }
    }
  }
}

// Rays aimed at edges that two triangles share: Embree's usual scenes let a fifth of them through.
TEST(Maps, RaysAtSharedEdges_HitTheSurface) {
  constexpr int kCells = 24;
  Mesh mesh;
  mesh.vertices.resize((kCells + 1) * (kCells + 1), 3);
  mesh.faces.resize(2 * kCells * kCells, 3);
  Index face = 0;
  for (int y = 0; y <= kCells; ++y) {
    for (int x = 0; x <= kCells; ++x) {
      const int v = y * (kCells + 1) + x;
      mesh.vertices.row(v) << 0.1 * x - 1.2, 0.1 * y - 1.2, 0;
      if (x < kCells && y < kCells) {
        mesh.faces.row(face++) << v, v + 1, v + kCells + 2;
        mesh.faces.row(face++) << v, v + kCells + 2, v + kCells + 1;
      }
    }
  }
  Scene scene;
  scene.meshes.push_back({mesh, matt({1, 1, 1})});
  const PreparedScene prepared = prepare(scene);
  for (const double off : {0.0, 0.5}) {  // through the middle of upright edges, of the diagonals
    Camera camera = look_at({0, 0, 3}, {0, 0, 0}, 21, 21, 30);
    camera.cx += off;  // a pixel is 0.1 wide on the surface
    camera.cy += 0.5;
    const SurfaceMaps maps = surface_maps(prepared, camera);
    for (int y = 0; y < 21; ++y) {
      for (int x = 0; x < 21; ++x) {
        EXPECT_EQ(maps.mesh.at(x, y), 0) << x << " " << y << ", " << off;
      }
    }
  }
}

TEST(Maps, BarycentricsAndUv_ReconstructThePoint) {
  const Mesh mesh = sphere(12, 24);
  Scene scene;
  scene.meshes.push_back({rectangle({5, 0, 0}, {1, 0, 0}, {0, 1, 0}), matt({1, 1, 1})});
  scene.meshes.push_back({mesh, matt({1, 1, 1})});
  const SurfaceMaps maps = surface_maps(prepare(scene), look_at({0, 1, 4}, {0, 0, 0}, 33, 33, 50));
  int seen = 0;
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 33; ++x) {
      const int face = maps.face.at(x, y);
      if (maps.mesh.at(x, y) != 1) {
        continue;
      }
      ++seen;
      Eigen::Vector3d p(0, 0, 0);
      Eigen::Vector2d t(0, 0);
      for (int k = 0; k < 3; ++k) {
        p += maps.barycentric.at(x, y, k) * mesh.vertices.row(mesh.faces(face, k)).transpose();
        t += maps.barycentric.at(x, y, k) * mesh.uvs.row(mesh.uv_faces(face, k)).transpose();
      }
      EXPECT_NEAR(p.x(), maps.position.at(x, y, 0), 1e-5);
      EXPECT_NEAR(p.y(), maps.position.at(x, y, 1), 1e-5);
      EXPECT_NEAR(t.x(), maps.uv.at(x, y, 0), 1e-5);
      EXPECT_NEAR(t.y(), maps.uv.at(x, y, 1), 1e-5);
    }
  }
  EXPECT_GT(seen, 300);
}

TEST(Maps, FrontFacingPoints_AreVisible) {
  const Mesh mesh = sphere(24, 48);
  Scene scene;
  scene.meshes.push_back({mesh, matt({1, 1, 1})});
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, 100, 100, 200);
  const std::vector<bool> visible = visible_points(prepare(scene), camera, mesh.vertices, 0.005);
  for (Index i = 0; i < mesh.vertices.rows(); ++i) {
    const double z = mesh.vertices(i, 2);  // the horizon of a sphere from distance 5 lies at 1/5
    if (z > 0.3) {
      EXPECT_TRUE(visible[static_cast<std::size_t>(i)]) << z;
    } else if (z < 0.1) {
      EXPECT_FALSE(visible[static_cast<std::size_t>(i)]) << z;
    }
  }
}

TEST(Maps, PointsOutsideTheImage_AreNotVisible) {
  Points points(3, 3);
  points << 0, 0, 0, 50, 0, 0, 0, 0, 10;
  const Scene empty;
  const std::vector<bool> visible =
      visible_points(prepare(empty), look_at({0, 0, 5}, {0, 0, 0}, 10, 10, 10), points);
  EXPECT_EQ(visible, (std::vector<bool>{true, false, false}));
}

}  // namespace
}  // namespace atelier
