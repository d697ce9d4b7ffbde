// What must not be rendered, and the words that say so.

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/mip_pyramid.h"
#include "core/render/render.h"
#include "core/render/surface_maps.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

constexpr float kRefusalNan = std::numeric_limits<float>::quiet_NaN();

Scene good_scene() {
  Scene scene;
  scene.meshes.push_back({fixtures::sphere(6, 8), fixtures::matt({0.5f, 0.5f, 0.5f})});
  scene.area_lights.push_back({});
  return scene;
}

Camera good_camera() {
  return fixtures::look_at({0, 0, 5}, {0, 0, 0}, 8, 8, 10);
}

void expect_refused(const Scene& scene, const std::string& where, const std::string& words) {
  try {
    prepare(scene);
    FAIL() << "accepted: " << where;
  } catch (const DataError& error) {
    EXPECT_THAT(std::string(error.file) + " " + error.where, HasSubstr(where));
    EXPECT_THAT(std::string(error.what()), HasSubstr(words));
  }
}

void expect_refused(const RenderOptions& options, const std::string& words) {
  try {
    render(good_scene(), good_camera(), options);
    FAIL() << "accepted: " << words;
  } catch (const LogicError& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

TEST(Refusal, ValidScene_IsAccepted) {
  EXPECT_NO_THROW(render(good_scene(), good_camera()));
}

TEST(Refusal, NanVertex_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].mesh.vertices(3, 1) = kRefusalNan;
  expect_refused(scene, "mesh 0", "finite");
}

TEST(Refusal, VertexBeyondFloat_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].mesh.vertices(3, 1) = 1e300;
  expect_refused(scene, "vertex 3", "float");
}

TEST(Refusal, FaceIndexOutOfRange_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].mesh.faces(2, 0) = 100'000;
  expect_refused(scene, "mesh 0", "100000");
}

TEST(Refusal, NegativeFaceIndex_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].mesh.faces(2, 0) = -1;
  expect_refused(scene, "mesh 0", "-1");
}

TEST(Refusal, TextureWithoutUvs_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].mesh.uvs.resize(0, 2);
  scene.meshes[0].mesh.uv_faces.resize(0, 3);
  scene.meshes[0].look.texture = std::make_shared<Image>(4, 4, 3, 0.5f);
  expect_refused(scene, "mesh 0 texture", "uvs");
}

TEST(Refusal, OneChannelTexture_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.texture = std::make_shared<Image>(4, 4, 1, 0.5f);
  expect_refused(scene, "mesh 0 texture", "3 channels");
}

TEST(Refusal, TextureDataTooShort_Throws) {
  Scene scene = good_scene();
  auto texture = std::make_shared<Image>(4, 4, 3, 0.5f);
  texture->data.pop_back();
  scene.meshes[0].look.texture = texture;
  expect_refused(scene, "mesh 0 texture", "47 numbers");
}

TEST(Refusal, NanInTexture_Throws) {
  Scene scene = good_scene();
  auto texture = std::make_shared<Image>(4, 4, 3, 0.5f);
  texture->data[7] = kRefusalNan;
  scene.meshes[0].look.texture = texture;
  expect_refused(scene, "mesh 0 texture", "finite");
}

TEST(Refusal, EmptyTexture_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.texture = std::make_shared<Image>();
  expect_refused(scene, "mesh 0 texture", "0x0");
}

TEST(Refusal, ReflectanceAboveOne_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.color = {0.5f, 1.5f, 0.5f};
  expect_refused(scene, "mesh 0 color", "[0,1]");
}

TEST(Refusal, NanReflectance_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.color = {kRefusalNan, 0.5f, 0.5f};
  expect_refused(scene, "mesh 0 color", "nan");
}

TEST(Refusal, ZeroRoughness_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.roughness = 0;
  expect_refused(scene, "mesh 0 roughness", "0.05");
}

TEST(Refusal, SheenAboveOne_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.sheen = 2;
  expect_refused(scene, "mesh 0 sheen", "2.0");
}

TEST(Refusal, BackColorOutOfRange_Throws) {
  Scene scene = good_scene();
  scene.meshes[0].look.back_color = Eigen::Vector3f(0, -1, 0);
  expect_refused(scene, "mesh 0 back_color", "-1");
}

TEST(Refusal, AreaLightWithoutArea_Throws) {
  Scene scene = good_scene();
  scene.area_lights[0].half_u = {0, 0, 0};
  expect_refused(scene, "area light 0", "without area");
}

TEST(Refusal, NonRectangularLight_Throws) {
  Scene scene = good_scene();
  scene.area_lights[0].half_v = {0.5, 0, -0.5};
  expect_refused(scene, "area light 0", "orthogonal");
}

TEST(Refusal, NanLightPosition_Throws) {
  Scene scene = good_scene();
  scene.area_lights[0].center.x() = kRefusalNan;
  expect_refused(scene, "area light 0", "finite");
}

TEST(Refusal, NegativeRadiance_Throws) {
  Scene scene = good_scene();
  scene.area_lights[0].radiance = {1, -1, 1};
  expect_refused(scene, "area light 0 radiance", "negative");
}

TEST(Refusal, InfiniteEnvironmentRadiance_Throws) {
  Scene scene = good_scene();
  scene.environment.zenith = {std::numeric_limits<float>::infinity(), 0, 0};
  expect_refused(scene, "environment zenith", "inf");
}

TEST(Refusal, OneChannelEnvironmentImage_Throws) {
  Scene scene = good_scene();
  scene.environment.image = std::make_shared<Image>(4, 2, 1, 1.0f);
  expect_refused(scene, "environment image", "3 channels");
}

TEST(Refusal, NegativeEnvironmentImage_Throws) {
  Scene scene = good_scene();
  scene.environment.image = std::make_shared<Image>(4, 2, 3, -1.0f);
  expect_refused(scene, "environment image", "negative");
}

TEST(Refusal, NanGroundHeight_Throws) {
  Scene scene = good_scene();
  scene.ground = Ground{};
  scene.ground->height = kRefusalNan;
  expect_refused(scene, "ground height", "nan");
}

TEST(Refusal, NanBackground_Throws) {
  Scene scene = good_scene();
  scene.background.bottom = {0, kRefusalNan, 0};
  expect_refused(scene, "background bottom", "nan");
}

TEST(Refusal, ZeroSamples_Throws) {
  expect_refused(RenderOptions{.samples = 0}, "samples must lie in [1, 1024]");
}

TEST(Refusal, TooManySamples_Throws) {
  expect_refused(RenderOptions{.samples = 1025}, "samples must");
}

TEST(Refusal, ZeroShadowSamples_Throws) {
  expect_refused(RenderOptions{.shadow_samples = 0}, "shadow_samples must");
}

TEST(Refusal, NegativePenumbraSamples_Throws) {
  expect_refused(RenderOptions{.penumbra_samples = -1}, "penumbra_samples must");
}

TEST(Refusal, ZeroAmbientSamples_Throws) {
  expect_refused(RenderOptions{.ambient_samples = 0}, "ambient_samples must");
}

TEST(Refusal, ZeroVertexSamplesOrNegativeReach_Throws) {
  EXPECT_THROW(prepare(good_scene(), {.vertex_samples = 0}), LogicError);
  EXPECT_THROW(prepare(good_scene(), {.ground_reach = -1}), LogicError);
}

TEST(Refusal, CameraWithoutPixels_Throws) {
  Camera camera = good_camera();
  camera.width = 0;
  EXPECT_THROW(render(good_scene(), camera), DataError);
  EXPECT_THROW(surface_maps(prepare(good_scene()), camera), DataError);
}

TEST(Refusal, NanFocalLength_Throws) {
  Camera camera = good_camera();
  camera.fx = kRefusalNan;
  EXPECT_THROW(render(good_scene(), camera), DataError);
}

TEST(Refusal, NonOrthonormalRotation_Throws) {
  Camera camera = good_camera();
  camera.camera_from_world_rotation *= 2;
  EXPECT_THROW(render(good_scene(), camera), DataError);
  EXPECT_THROW(visible_points(prepare(good_scene()), camera, Points::Zero(1, 3)), DataError);
}

TEST(Refusal, NegativeVisibilityTolerance_Throws) {
  EXPECT_THROW(visible_points(prepare(good_scene()), good_camera(), Points::Zero(1, 3), -1),
               LogicError);
}

TEST(Refusal, MipPyramidOfBadImage_Throws) {
  EXPECT_THROW(mip_pyramid(Image()), LogicError);
  EXPECT_THROW(mip_pyramid(Image(2, 2, 4)), LogicError);
}

TEST(Degenerate, MeshWithoutFaces_IsInvisible) {
  Scene scene = good_scene();
  scene.meshes[0].mesh.faces.resize(0, 3);
  scene.meshes[0].mesh.uv_faces.resize(0, 3);
  const Image image = render(scene, good_camera(), {.alpha = true});
  EXPECT_EQ(*std::max_element(image.data.begin(), image.data.end()), 0);
}

TEST(Degenerate, ZeroAreaFaces_GiveFiniteLight) {
  Scene scene = good_scene();
  Mesh& mesh = scene.meshes[0].mesh;
  for (Index f = 0; f < mesh.faces.rows(); f += 3) {
    mesh.faces(f, 1) = mesh.faces(f, 0);
  }
  scene.environment = constant_environment({1, 1, 1});
  for (const Ambient ambient : {Ambient::PerPixel, Ambient::PerVertex}) {
    const Image image = render(prepare(scene, {.ambient = ambient}), good_camera());
    for (const float value : image.data) {
      ASSERT_TRUE(std::isfinite(value));
    }
  }
}

TEST(Degenerate, CameraInsideMesh_SeesItsInside) {
  Scene scene = good_scene();
  scene.environment = constant_environment({1, 1, 1});
  const Image image =
      render(scene, fixtures::look_at({0, 0, 0}, {0, 0, 1}, 8, 8, 10), {.alpha = true});
  EXPECT_EQ(image.at(4, 4, 3), 1);
}

TEST(Degenerate, OnePixelImage_IsRendered) {
  Camera camera = good_camera();
  camera.width = camera.height = 1;
  camera.cx = camera.cy = 0.5;
  EXPECT_EQ(render(good_scene(), camera).data.size(), 3u);
}

}  // namespace
}  // namespace atelier
