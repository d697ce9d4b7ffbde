// Radiance against closed forms: environment, area lights, shadows, ambient occlusion.

#include <gtest/gtest.h>

#include "core/random.h"
#include "core/render/environment_light.h"
#include "core/render/rectangle_light.h"
#include "core/render/reflectance.h"
#include "core/render/render.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using fixtures::color_at;
using fixtures::floor_grid;
using fixtures::look_at;
using fixtures::matt;
using fixtures::rectangle;
using fixtures::sphere;

Scene lone(const Mesh& mesh, const Look& look, const Environment& environment) {
  Scene scene;
  scene.meshes.push_back({mesh, look});
  scene.environment = environment;
  return scene;
}

TEST(Environment, SphereUnderConstantLight_ShowsItsReflectance) {
  const Scene scene = lone(sphere(), matt({0.2f, 0.5f, 0.8f}), constant_environment({0.5f, 1, 2}));
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, 32, 32, 60);
  const Image image = render(scene, camera, {.samples = 16});
  for (int y = 10; y < 22; ++y) {
    for (int x = 10; x < 22; ++x) {
      EXPECT_NEAR(image.at(x, y, 0), 0.1, 0.001);
      EXPECT_NEAR(image.at(x, y, 1), 0.5, 0.005);
      EXPECT_NEAR(image.at(x, y, 2), 1.6, 0.016);
    }
  }
}

// A white furnace: what reflects everything and stands in uniform light cannot be seen.
TEST(Environment, WhiteFurnace_ConservesEnergy) {
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, 24, 24, 50);
  for (const float roughness : {0.1f, 0.4f, 0.8f, 1.0f}) {
    for (const float specular : {0.0f, 0.5f, 1.0f}) {
      for (const float sheen : {0.0f, 0.6f}) {
        Look look = matt({1, 1, 1});
        look.roughness = roughness;
        look.specular = specular;
        look.sheen = sheen;
        const Image image =
            render(lone(sphere(), look, constant_environment({1, 1, 1})), camera, {.samples = 4});
        for (int x = 4; x < 20; ++x) {
          EXPECT_NEAR(image.at(x, 12), 1.0, 0.01)
              << "roughness " << roughness << " specular " << specular << " sheen " << sheen;
        }
      }
    }
  }
}

TEST(Environment, WhiteMetal_ReflectsEverything) {
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, 8, 8, 20);
  Look look;
  look.color = {1, 1, 1};
  look.metallic = 1;
  for (const float roughness : {0.05f, 0.5f, 1.0f}) {
    look.roughness = roughness;
    const float center =
        render(lone(sphere(), look, constant_environment({1, 1, 1})), camera).at(4, 4);
    EXPECT_NEAR(center, 1, 0.01) << roughness;
  }
}

TEST(Environment, GradientSky_GivesAnalyticIrradiance) {
  // Radiance h + (z - h) sin(elevation): irradiance pi h + (z - h) 2 pi / 3.
  Environment sky;
  sky.zenith = {1, 1, 1};
  sky.horizon = {0.25f, 0.25f, 0.25f};
  const EnvironmentLight light = environment_light(sky, std::nullopt);
  EXPECT_NEAR(open_irradiance(light, {0, 1, 0}).x,
              std::numbers::pi * 0.25 + 0.75 * 2 * std::numbers::pi / 3, 1e-3);
}

TEST(Environment, Ground_ReflectsLightUpwards) {
  // A plane facing down over white ground under a sky of radiance 1 sees radiance 1.
  Scene scene = lone(rectangle({0, 1, 0}, {0.01, 0, 0}, {0, 0, 0.01}), matt({1, 1, 1}),
                     constant_environment({1, 1, 1}));
  scene.ground = Ground{0, {0.5f, 0.5f, 0.5f}, true};
  const Camera camera = look_at({0, 0.2, 0}, {0, 1, 0}, 8, 8, 2000);
  const Image image = render(scene, camera, {.samples = 64});
  EXPECT_NEAR(image.at(4, 4), 0.5, 0.01);
}

TEST(Environment, ConstantImage_EqualsConstantGradient) {
  Environment environment;
  environment.image = std::make_shared<Image>(16, 8, 3, 0.7f);
  const EnvironmentLight light = environment_light(environment, std::nullopt);
  for (const Vec3f n : {Vec3f{0, 1, 0}, Vec3f{0, -1, 0}, normalized(Vec3f{1, 0.2f, -0.5f})}) {
    EXPECT_NEAR(open_irradiance(light, n).x, 0.7 * std::numbers::pi, 0.01);
    EXPECT_NEAR(glossy_radiance(light, n, 0.5f).x, 0.7, 1e-4);
  }
}

TEST(Environment, ImageRowsAndColumns_MapToDocumentedDirections) {
  Environment environment;
  auto image = std::make_shared<Image>(64, 32, 3, 0.0f);
  for (int c = 0; c < 3; ++c) {
    image->at(32, 16, c) = image->at(31, 16, c) = image->at(32, 15, c) = image->at(31, 15, c) = 1;
    image->at(48, 16, c) = image->at(47, 16, c) = image->at(48, 15, c) = image->at(47, 15, c) = 2;
    for (int x = 0; x < 64; ++x) {
      image->at(x, 0, c) = 3;
    }
  }
  environment.image = image;
  EXPECT_NEAR(source_radiance(environment, {0, 0, -1}).x, 1, 1e-4);
  EXPECT_NEAR(source_radiance(environment, {1, 0, 0}).x, 2, 1e-4);
  EXPECT_NEAR(source_radiance(environment, {0, 1, 0}).x, 3, 1e-4);
  EXPECT_NEAR(source_radiance(environment, {0, 0, 1}).x, 0, 1e-4);
}

TEST(Environment, SmallSun_IsIntegratedExactly) {
  Environment environment;
  auto image = std::make_shared<Image>(256, 128, 3, 0.0f);
  double solid = 0;
  double expected = 0;
  // 6 x 6 pixels about elevation 55 degrees.
  for (int y = 22; y < 28; ++y) {
    for (int x = 100; x < 106; ++x) {
      for (int c = 0; c < 3; ++c) {
        image->at(x, y, c) = 100;
      }
      const double polar = std::numbers::pi * (y + 0.5) / 128;
      const double pixel =
          (2 * std::numbers::pi / 256) *
          (std::cos(std::numbers::pi * y / 128) - std::cos(std::numbers::pi * (y + 1) / 128));
      solid += pixel;
      expected += 100 * pixel * std::cos(polar);
    }
  }
  environment.image = image;
  const EnvironmentLight light = environment_light(environment, std::nullopt);
  EXPECT_NEAR(open_irradiance(light, {0, 1, 0}).x, expected, 0.02 * expected) << solid;
}

TEST(Environment, LowRoughness_IsNotBlurred) {
  Environment sky;
  sky.zenith = {1, 0, 0};
  sky.horizon = {0, 1, 0};
  const EnvironmentLight light = environment_light(sky, std::nullopt);
  const Vec3f up = normalized(Vec3f{0.3f, 0.8f, 0.1f});
  EXPECT_NEAR(glossy_radiance(light, up, 0).x, radiance(light, up).x, 0.01);
  EXPECT_NEAR(glossy_radiance(light, up, 0.05f).y, radiance(light, up).y, 0.02);
}

// Differential element to a parallel rectangle over its corner (Howell's catalogue, B-4).
double corner_factor(double a, double b, double c) {
  const double A = a / c, B = b / c;
  return (A / std::sqrt(1 + A * A) * std::atan(B / std::sqrt(1 + A * A)) +
          B / std::sqrt(1 + B * B) * std::atan(A / std::sqrt(1 + B * B))) /
         (2 * std::numbers::pi);
}

AreaLight overhead(double half_x, double half_z, double height) {
  AreaLight light;
  light.center = {0, height, 0};
  light.half_u = {half_x, 0, 0};
  light.half_v = {0, 0, half_z};  // u x v looks down
  return light;
}

TEST(AreaLight, Rectangle_HasAnalyticFormFactor) {
  const RectangleLight light = rectangle_light(overhead(0.5, 0.75, 2));
  EXPECT_NEAR(form_factor(light, {0, 0, 0}, {0, 1, 0}).value, 4 * corner_factor(0.5, 0.75, 2),
              1e-6);
  EXPECT_NEAR(form_factor(light, {0.5f, 0, 0.75f}, {0, 1, 0}).value, corner_factor(1, 1.5, 2),
              1e-6);
  EXPECT_EQ(form_factor(light, {0, 0, 0}, {0, -1, 0}).value, 0);
  EXPECT_EQ(form_factor(light, {0, 3, 0}, {0, -1, 0}).value, 0) << "the back does not shine";
}

TEST(AreaLight, DefaultLight_ShinesDown) {
  EXPECT_GT(form_factor(rectangle_light(AreaLight{}), {0, 0, 2}, {0, 1, 0}).value, 0);
}

TEST(AreaLight, FormFactor_MatchesQuadratureAtAnyTilt) {
  Random random{7, 1};
  const RectangleLight light = rectangle_light(overhead(0.6, 0.4, 1.2));
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3f p{static_cast<float>(uniform(random, -2, 2)),
                  static_cast<float>(uniform(random, -1, 1)),
                  static_cast<float>(uniform(random, -2, 2))};
    const Vec3f n =
        normalized(Vec3f{static_cast<float>(normal(random)), static_cast<float>(normal(random)),
                         static_cast<float>(normal(random))});
    double sum = 0;
    constexpr int kN = 120;
    for (int i = 0; i < kN; ++i) {
      for (int j = 0; j < kN; ++j) {
        const Vec3f d = light_point(light, {(i + 0.5f) / kN, (j + 0.5f) / kN}) - p;
        const double cos_n = std::max(0.0f, dot(d, n));
        const double cos_l = std::max(0.0f, -dot(d, light.normal));
        const double d2 = squared_norm(d);
        sum += cos_n * cos_l / (d2 * d2);
      }
    }
    const double expected = sum * light.area / (kN * kN) / std::numbers::pi;
    EXPECT_NEAR(form_factor(light, p, n).value, expected, 2e-4 + 1e-3 * expected) << trial;
  }
}

TEST(AreaLight, LitFloor_MatchesClosedForm) {
  Scene scene;
  scene.meshes.push_back({floor_grid(2, 1), matt({0.5f, 0.5f, 0.5f})});
  scene.area_lights.push_back(overhead(0.5, 0.5, 2));
  scene.area_lights.back().radiance = {3, 2, 1};
  const Camera camera = look_at({0, 1.5, 0}, {0, 0, 0}, 9, 9, 4000);
  const Image image = render(scene, camera, {.samples = 4});
  const double factor = 4 * corner_factor(0.5, 0.5, 2);
  EXPECT_NEAR(image.at(4, 4, 0), 3 * 0.5 * factor, 1e-4);
  EXPECT_NEAR(image.at(4, 4, 2), 1 * 0.5 * factor, 1e-4);
}

// A blocker whose straight edge lies at x = 0, height h, under a square light of half width a at
// height H: on the floor the penumbra is |x| < a h / (H - h).
TEST(AreaLight, Penumbra_MatchesGeometry) {
  constexpr double kA = 0.3, kHeight = 2, kBlocker = 0.5;
  const double half = kA * kBlocker / (kHeight - kBlocker);
  Scene scene;
  scene.meshes.push_back({floor_grid(3, 1), matt({1, 1, 1})});
  // Over x < 0.
  scene.meshes.push_back({rectangle({-1, kBlocker, 0}, {1, 0, 0}, {0, 0, -3}), matt({0, 0, 0})});
  scene.area_lights.push_back(overhead(kA, kA, kHeight));
  // From the floor's other side, so that the blocker hides nothing.
  const PreparedScene prepared = prepare(scene);
  const auto shade = [&](double x) {
    const Camera camera = look_at({x, 0.4, 0}, {x, 0, 0}, 3, 3, 20'000);
    return render(prepared, camera, {.samples = 16, .penumbra_samples = 32}).at(1, 1);
  };
  const double lit = shade(half + 0.05);
  EXPECT_NEAR(shade(-half - 0.02), 0, 1e-6);
  EXPECT_NEAR(shade(half + 0.02) / lit, 1, 0.02);
  EXPECT_NEAR(shade(0) / lit, 0.5, 0.02);
  EXPECT_NEAR(shade(-half / 2) / lit, 0.25, 0.02);
  EXPECT_NEAR(shade(half / 2) / lit, 0.75, 0.02);
}

TEST(AreaLight, LightPartlyBelowHorizon_IsUnbiased) {
  // A wall at x = 0 facing +x under a light centred over its plane: half of it shines.
  Scene scene;
  scene.meshes.push_back({rectangle({0, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}), matt({1, 1, 1})});
  scene.area_lights.push_back(overhead(0.5, 0.5, 1));
  const Camera camera = look_at({0.5, 0, 0}, {0, 0, 0}, 5, 5, 4000);
  const double expected =
      form_factor(rectangle_light(scene.area_lights[0]), {0, 0, 0}, {1, 0, 0}).value;
  EXPECT_GT(expected, 0.01);
  EXPECT_NEAR(render(scene, camera, {.samples = 256}).at(2, 2), expected, 0.01 * expected);
}

// A polished metal floor under a wide light shows the light itself, nearly without noise.
TEST(AreaLight, PolishedMetal_MirrorsTheLight) {
  Scene scene;
  Look look = matt({1, 1, 1});
  look.metallic = 1;
  look.roughness = 0.08f;
  scene.meshes.push_back({rectangle({0, 0, 0}, {2, 0, 0}, {0, 0, -2}), look});
  scene.area_lights.push_back(overhead(1, 1, 2));
  scene.area_lights.back().radiance = {3, 3, 3};
  const Camera camera = look_at({0, 2, 0.4}, {0, 0, 0}, 16, 16, 100);
  const Image image = render(scene, camera, {.samples = 8});
  double sum = 0;
  for (int y = 4; y < 12; ++y) {
    for (int x = 4; x < 12; ++x) {
      sum += image.at(x, y);
      EXPECT_NEAR(image.at(x, y), 3, 0.6);
    }
  }
  EXPECT_NEAR(sum / 64, 3, 0.06);
}

// Where both ways of sampling gloss meet, the light is the same on both sides.
TEST(AreaLight, Gloss_IsContinuousAcrossSamplingMethods) {
  Scene scene;
  Look look = matt({0, 0, 0});
  look.specular = 1;
  scene.meshes.push_back({rectangle({0, 0, 0}, {2, 0, 0}, {0, 0, -2}), look});
  scene.area_lights.push_back(overhead(0.4, 0.4, 2));
  const Camera camera = look_at({0, 2, 1}, {0, 0, 0}, 12, 12, 12);
  const auto total = [&](float roughness) {
    scene.meshes[0].look.roughness = roughness;
    double sum = 0;
    for (const float value : render(scene, camera, {.samples = 512}).data) {
      sum += value;
    }
    return sum;
  };
  const double below = total(0.499f);
  EXPECT_GT(below, 0);
  EXPECT_NEAR(total(0.501f), below, 0.015 * below);
}

TEST(AreaLight, Rays_HitOnlyTheEmittingSide) {
  const RectangleLight light = rectangle_light(overhead(0.5, 0.25, 2));
  EXPECT_NEAR(distance_to(light, {0.4f, 0, 0.2f}, {0, 1, 0}), 2, 1e-6);
  EXPECT_EQ(distance_to(light, {0.6f, 0, 0}, {0, 1, 0}), 0);
  EXPECT_EQ(distance_to(light, {0, 0, 0.3f}, {0, 1, 0}), 0);
  EXPECT_EQ(distance_to(light, {0, 4, 0}, {0, -1, 0}), 0);
  EXPECT_EQ(distance_to(light, {0, 3, 0}, {0, 1, 0}), 0);
}

// Share of the cosine-weighted sky that an endless wall of height h at distance x hides.
double wall_share(double x, double h) {
  return 0.5 * (1 - x / std::sqrt(x * x + h * h));
}

Scene floor_with_wall(double height) {
  Scene scene;
  scene.meshes.push_back({floor_grid(3, 60), matt({1, 1, 1})});
  scene.meshes.push_back(
      {rectangle({0, height / 2, 0}, {0, 0, -200}, {0, height / 2, 0}), matt({0.5f, 0.5f, 0.5f})});
  scene.environment = constant_environment({1, 1, 1});
  return scene;
}

TEST(AmbientOcclusion, FloorBesideWall_MatchesAnalyticOcclusion) {
  const PreparedScene prepared = prepare(floor_with_wall(1));
  for (const double x : {0.05, 0.5, 1.0, 2.0}) {
    const Camera camera = look_at({x + 0.3, 0.5, 0}, {x, 0, 0}, 3, 3, 20'000);
    const Image image = render(prepared, camera, {.samples = 64, .ambient_samples = 64});
    EXPECT_NEAR(image.at(1, 1), 1 - wall_share(x, 1), 0.005) << x;
  }
}

TEST(AmbientOcclusion, FootOfHighWall_SeesHalfTheSky) {
  const PreparedScene prepared = prepare(floor_with_wall(150));
  const Camera camera = look_at({0.6, 0.5, 0}, {0.01, 0, 0}, 3, 3, 20'000);
  EXPECT_NEAR(render(prepared, camera, {.samples = 64, .ambient_samples = 64}).at(1, 1), 0.5, 0.01);
}

TEST(AmbientOcclusion, PerVertex_AgreesWithPerPixel) {
  const Scene scene = floor_with_wall(1);
  const PreparedScene pixels = prepare(scene);
  const PreparedScene vertices =
      prepare(scene, {.ambient = Ambient::PerVertex, .vertex_samples = 512});
  const Camera camera = look_at({2.5, 2, 0}, {1, 0, 0}, 16, 16, 14);
  const Image a = render(pixels, camera, {.samples = 16, .ambient_samples = 32});
  const Image b = render(vertices, camera, {.samples = 16});
  for (int x = 0; x < 16; ++x) {
    EXPECT_NEAR(a.at(x, 12), b.at(x, 12), 0.02) << x;
  }
}

TEST(AmbientOcclusion, SeamlessGround_DarkensUnderObjectInBothModes) {
  Scene scene;
  scene.meshes.push_back({sphere(24, 48, 0.5, {0, 0.5, 0}), matt({0.5f, 0.5f, 0.5f})});
  scene.environment = constant_environment({1, 1, 1});
  scene.background.top = scene.background.bottom = {0.8f, 0.8f, 0.8f};
  scene.ground = Ground{};
  for (const Ambient mode : {Ambient::PerPixel, Ambient::PerVertex}) {
    const PreparedScene prepared = prepare(scene, {.ambient = mode, .vertex_samples = 512});
    const auto shade = [&](double x) {
      const Camera camera = look_at({x, 0.05, 0.5}, {x, 0, 0}, 3, 3, 20'000);
      return render(prepared, camera, {.samples = 64, .ambient_samples = 32}).at(1, 1) / 0.8;
    };
    // A sphere of radius r whose centre is d away hides (r/d)^2 cos(theta) of a plane that it does
    // not cut: here r = 0.5, height 0.5, d^2 = x^2 + 0.25.
    for (const double x : {0.5, 1.0}) {
      const double d2 = x * x + 0.25;
      EXPECT_NEAR(shade(x), 1 - 0.25 / d2 * (0.5 / std::sqrt(d2)), 0.01) << x;
    }
    EXPECT_NEAR(shade(20), 1, 1e-3);
  }
}

TEST(Reflectance, Gloss_IsReciprocalWithAlbedoBelowOne) {
  for (const float roughness : {0.05f, 0.3f, 0.7f, 1.0f}) {
    for (const float v : {0.05f, 0.4f, 0.9f}) {
      for (const float l : {0.1f, 0.6f}) {
        EXPECT_NEAR(ggx(v, l, 0.8f, roughness), ggx(l, v, 0.8f, roughness),
                    1e-5f * ggx(v, l, 0.8f, roughness));
      }
      const GlossAlbedo albedo = gloss_albedo(v, roughness);
      EXPECT_GT(albedo.scale, 0);
      EXPECT_GE(albedo.bias, 0);
      EXPECT_LE(albedo.scale + albedo.bias, 1.01f);
    }
  }
}

TEST(Reflectance, RoughestGlossHeadOn_HasAnalyticAlbedo) {
  // alpha = 1 makes the lobe 1 / (2 pi (1 + cos)): its integral is 1 - ln 2.
  const GlossAlbedo albedo = gloss_albedo(1, 1);
  EXPECT_NEAR(albedo.scale + albedo.bias, 1 - std::log(2.0), 0.005);
}

TEST(Reflectance, GlossAlbedo_MatchesIntegratedLobe) {
  for (const float roughness : {0.4f, 0.8f}) {
    for (const float n_dot_v : {0.3f, 0.8f}) {
      const Vec3f v{std::sqrt(1 - n_dot_v * n_dot_v), 0, n_dot_v};
      double sum = 0;
      constexpr int kN = 1 << 16;
      for (int i = 0; i < kN; ++i) {
        const Vec3f l = cosine_direction(sobol_point(static_cast<std::uint32_t>(i), 99));
        const Vec3f h = normalized(v + l);
        const double f = 0.04 + 0.96 * fresnel_weight(dot(v, h));
        sum += std::numbers::pi * f * ggx(n_dot_v, std::max(1e-6f, l.z), h.z, roughness);
      }
      const GlossAlbedo albedo = gloss_albedo(n_dot_v, roughness);
      EXPECT_NEAR(sum / kN, 0.04 * albedo.scale + albedo.bias, 0.004)
          << roughness << " " << n_dot_v;
    }
  }
}

TEST(Reflectance, Sheen_IsStrongestAtGrazingAngles) {
  EXPECT_GT(sheen_albedo(0.1f), 2 * sheen_albedo(1.0f));
  for (float c = 0; c <= 1; c += 0.1f) {
    EXPECT_LE(sheen_albedo(c), 1.0f);
    EXPECT_GE(sheen_albedo(c), 0.0f);
  }
}

TEST(Sampling, AlignedRuns_AreDigitalNets) {
  // Every elementary interval of area 1/64 holds one of 64 points.
  for (const std::uint32_t seed : {0u, 1u, 12345u, 0xFFFFFFFFu}) {
    for (const std::uint32_t first : {0u, 64u, 640u}) {
      for (int kx = 0; kx <= 6; ++kx) {
        std::vector<int> count(64, 0);
        for (std::uint32_t i = first; i < first + 64; ++i) {
          const Point2f p = sobol_point(i, seed);
          ASSERT_GE(p.x, 0);
          ASSERT_LT(p.x, 1);
          ASSERT_LT(p.y, 1);
          const int x = static_cast<int>(p.x * (1 << kx));
          const int y = static_cast<int>(p.y * (1 << (6 - kx)));
          ++count[static_cast<std::size_t>(y * (1 << kx) + x)];
        }
        EXPECT_EQ(*std::max_element(count.begin(), count.end()), 1) << seed << " " << kx;
      }
    }
  }
}

TEST(Sampling, DifferentSeeds_GiveDifferentPoints) {
  double distance = 0;
  for (std::uint32_t i = 0; i < 64; ++i) {
    distance += std::abs(sobol_point(i, 1).x - sobol_point(i, 2).x);
  }
  EXPECT_GT(distance / 64, 0.15);
}

TEST(Sampling, CosineDirections_HaveExpectedMoments) {
  double z = 0, z2 = 0, x = 0;
  constexpr int kN = 4096;
  for (std::uint32_t i = 0; i < kN; ++i) {
    const Vec3f d = cosine_direction(sobol_point(i, 5));
    EXPECT_NEAR(squared_norm(d), 1, 1e-5);
    z += d.z;
    z2 += d.z * d.z;
    x += d.x;
  }
  EXPECT_NEAR(z / kN, 2.0 / 3, 1e-3);
  EXPECT_NEAR(z2 / kN, 0.5, 1e-3);
  EXPECT_NEAR(x / kN, 0, 1e-3);
}

}  // namespace
}  // namespace atelier
