#include "core/io/mesh_gltf.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::TemporaryDirectory;
using ::testing::HasSubstr;

GltfScene parse(const std::string& file, const Limits& limits = {}) {
  return read_gltf(std::as_bytes(std::span(file)), "test", limits);
}

std::string mesh_gltf_refusal(const std::string& file, const Limits& limits = {}) {
  try {
    parse(file, limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "was read";
}

Mesh colored_sphere() {
  Mesh mesh = fixtures::sphere(2);
  const Index n = mesh.vertices.rows();
  mesh.normals = vertex_normals(mesh.vertices, mesh.faces);
  mesh.colors.resize(n, 3);
  mesh.uvs.resize(n, 2);
  for (Index i = 0; i < n; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(n);
    mesh.colors.row(i) << t, 1 - t, 0.25F;
    mesh.uvs.row(i) << i / 64.0, 1 - i / 128.0;
  }
  mesh.uv_faces = mesh.faces;
  return mesh;
}

/// Triangles from their smallest corner on, sorted.
std::vector<std::array<int, 3>> turned_alike(const Triangles& faces) {
  std::vector<std::array<int, 3>> all;
  for (Index f = 0; f < faces.rows(); ++f) {
    std::array<int, 3> face = {faces(f, 0), faces(f, 1), faces(f, 2)};
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    all.push_back(face);
  }
  std::sort(all.begin(), all.end());
  return all;
}

// A ball of 21 by 21 vertices, compressed by meshoptimizer's own encoder through glTF-Transform:
// attributes, triangles and an index sequence, octahedral normals, a path with exponents, turns
// as quaternions of three parts; quantized positions.
TEST(GltfRead, MeshoptStreams_DecodeAsTheirEncoderMeantThem) {
  constexpr int kSide = 20;
  const GltfScene scene = read_gltf(fixtures::source_directory() / "fuzz/corpus/gltf/meshopt.glb");
  const GltfPrimitive& ball = scene.meshes[0].primitives[0];
  ASSERT_EQ(ball.mesh.vertices.rows(), (kSide + 1) * (kSide + 1));
  for (int i = 0; i <= kSide; ++i) {
    for (int j = 0; j <= kSide; ++j) {
      const double a = std::numbers::pi * (i + 0.5) / (kSide + 1);
      const double b = 2 * std::numbers::pi * j / kSide;
      const Eigen::RowVector3d on_ball(std::sin(a) * std::cos(b), std::cos(a),
                                       std::sin(a) * std::sin(b));
      const Index v = i * (kSide + 1) + j;
      EXPECT_LE((ball.mesh.vertices.row(v) - 16'384 * on_ball).cwiseAbs().maxCoeff(), 0.51);
      EXPECT_LE((ball.mesh.normals.row(v) - on_ball).cwiseAbs().maxCoeff(), 0.015);
    }
  }
  Triangles faces(2 * kSide * kSide, 3);
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const int v = i * (kSide + 1) + j;
      faces.row(2 * (i * kSide + j)) << v, v + 1, v + kSide + 2;
      faces.row(2 * (i * kSide + j) + 1) << v, v + kSide + 2, v + kSide + 1;
    }
  }
  EXPECT_EQ(turned_alike(ball.mesh.faces), turned_alike(faces));
  const Triangles& strip = scene.meshes[0].primitives[1].mesh.faces;
  ASSERT_EQ(strip.rows(), 2 * kSide);
  EXPECT_EQ(strip.row(0), Eigen::RowVector3i(0, kSide + 1, 1));

  ASSERT_EQ(scene.animations.size(), 1u);
  const GltfChannel& path = scene.animations[0].channels[0];
  const GltfChannel& turn = scene.animations[0].channels[1];
  ASSERT_EQ(path.values.rows(), 40);
  for (Index k = 0; k < 40; ++k) {
    const double t = static_cast<double>(k);
    EXPECT_NEAR(path.times[static_cast<std::size_t>(k)], t / 30, 1e-6);
    EXPECT_LT((path.values.row(k) - Eigen::RowVector3d(0.1 * t, std::sin(t / 7), -0.25)).norm(),
              2e-3);
    EXPECT_LT(
        (turn.values.row(k) - Eigen::RowVector4d(0, std::sin(0.04 * t), 0, std::cos(0.04 * t)))
            .norm(),
        1e-3);
  }
}

/// An arm of two bones along x with an elbow at 1, as `bodymodel` would write one.
GltfScene bent_arm() {
  GltfScene scene;
  GltfPrimitive primitive;
  const int rings = 9;
  primitive.mesh.vertices.resize(4 * rings, 3);
  primitive.joints = Eigen::MatrixXi::Zero(4 * rings, 4);
  primitive.weights = Eigen::MatrixXd::Zero(4 * rings, 4);
  std::vector<Eigen::RowVector3i> faces;
  for (int r = 0; r < rings; ++r) {
    const double x = 2.0 * r / (rings - 1);
    for (int k = 0; k < 4; ++k) {
      const double angle = k * std::numbers::pi / 2;
      primitive.mesh.vertices.row(4 * r + k) << x, 0.1 * std::cos(angle), 0.1 * std::sin(angle);
      const double forearm = std::clamp((x - 0.75) / 0.5, 0.0, 1.0);
      primitive.joints.row(4 * r + k) << 0, 1, 0, 0;
      primitive.weights.row(4 * r + k) << 1 - forearm, forearm, 0, 0;
      if (r > 0) {
        const int a = 4 * r + k;
        const int b = 4 * r + (k + 1) % 4;
        faces.emplace_back(a, b, a - 4);
        faces.emplace_back(b, b - 4, a - 4);
      }
    }
  }
  primitive.mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    primitive.mesh.faces.row(static_cast<Index>(f)) = faces[f];
  }
  scene.meshes.emplace_back().primitives.push_back(primitive);
  scene.meshes[0].name = "arm";
  scene.nodes.resize(3);
  scene.nodes[0].name = "shoulder";
  scene.nodes[1].name = "elbow";
  scene.nodes[1].parent = 0;
  scene.nodes[1].translation = {1, 0, 0};
  scene.nodes[2].name = "skin";
  scene.nodes[2].mesh = 0;
  scene.nodes[2].skin = 0;
  scene.roots = {0, 2};
  Eigen::Matrix4d elbow = Eigen::Matrix4d::Identity();
  elbow(0, 3) = -1;
  scene.skins.push_back(
      {.name = "bones", .joints = {0, 1}, .inverse_binds = {Eigen::Matrix4d::Identity(), elbow}});
  GltfChannel channel;
  channel.node = 1;
  channel.times = {0, 0.5, 1};
  channel.values.resize(3, 4);
  channel.values << 0, 0, 0, 1, 0, 0, std::sqrt(0.5), std::sqrt(0.5), 0, 0, 0, 1;
  scene.animations.push_back({.name = "bend", .channels = {channel}});
  return scene;
}

TEST(GltfRoundTrip, StaticMeshWithAllAttributes_RoundTrips) {
  const TemporaryDirectory folder;
  const Mesh mesh = colored_sphere();
  for (const char* name : {"a.glb", "a.gltf"}) {
    write_gltf(folder / name, gltf_scene(mesh, "ball"));
    const GltfScene scene = read_gltf(folder / name);
    ASSERT_EQ(scene.meshes.size(), 1u);
    EXPECT_EQ(scene.meshes[0].name, "ball");
    const Mesh back = rest_mesh(scene);
    EXPECT_EQ(back.faces, mesh.faces);
    EXPECT_EQ(back.vertices.cast<float>(), mesh.vertices.cast<float>());
    EXPECT_EQ(back.colors, mesh.colors);
    EXPECT_EQ(back.uv_faces, mesh.uv_faces);
    EXPECT_LT((back.normals - mesh.normals).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((back.uvs - mesh.uvs).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(GltfRoundTrip, TextureSeams_SplitVerticesAndKeepCorners) {
  Mesh mesh = colored_sphere();
  const Index n = mesh.vertices.rows();
  mesh.uvs.conservativeResize(n + 1, 2);
  mesh.uvs.row(n) << 0.5, 0.75;
  mesh.uv_faces(3, 1) = static_cast<int>(n);
  const Mesh back = rest_mesh(parse(glb_bytes(gltf_scene(mesh))));
  EXPECT_EQ(back.vertices.rows(), n + 1);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT((back.vertices.row(back.faces(f, c)) - mesh.vertices.row(mesh.faces(f, c))).norm(),
                1e-6);
      EXPECT_LT((back.uvs.row(back.uv_faces(f, c)) - mesh.uvs.row(mesh.uv_faces(f, c))).norm(),
                1e-6);
    }
  }
}

TEST(GltfRoundTrip, SkinAnimationAndNames_RoundTrip) {
  const GltfScene scene = bent_arm();
  const GltfScene back = parse(glb_bytes(scene));
  ASSERT_EQ(back.nodes.size(), 3u);
  EXPECT_EQ(back.nodes[1].name, "elbow");
  EXPECT_EQ(back.nodes[1].parent, 0);
  EXPECT_EQ(back.nodes[1].translation, scene.nodes[1].translation);
  EXPECT_EQ(back.roots, scene.roots);
  ASSERT_EQ(back.skins.size(), 1u);
  EXPECT_EQ(back.skins[0].joints, scene.skins[0].joints);
  EXPECT_EQ(back.skins[0].inverse_binds, scene.skins[0].inverse_binds);
  const GltfPrimitive& primitive = back.meshes[0].primitives[0];
  EXPECT_LT((primitive.weights - scene.meshes[0].primitives[0].weights).cwiseAbs().maxCoeff(),
            1e-7);
  for (Index v = 0; v < primitive.weights.rows(); ++v) {
    for (int k = 0; k < 4; ++k) {
      if (primitive.weights(v, k) > 0) {
        EXPECT_EQ(primitive.joints(v, k), scene.meshes[0].primitives[0].joints(v, k));
      }
    }
  }
  ASSERT_EQ(back.animations.size(), 1u);
  const GltfChannel& channel = back.animations[0].channels[0];
  EXPECT_EQ(channel.times, scene.animations[0].channels[0].times);
  EXPECT_EQ(channel.path, GltfPath::Rotation);
  EXPECT_LT((channel.values - scene.animations[0].channels[0].values).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(GltfRoundTrip, MorphSequence_ReproducesEveryFrame) {
  std::vector<Mesh> frames(5, fixtures::sphere(1));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    frames[f].vertices.array() *= 1 + 0.1 * static_cast<double>(f);
    frames[f].normals = vertex_normals(frames[f].vertices, frames[f].faces);
  }
  GltfScene back = parse(glb_bytes(gltf_morph_sequence(frames, 25, "cloth")));
  ASSERT_EQ(back.animations.size(), 1u);
  const GltfChannel& channel = back.animations[0].channels[0];
  ASSERT_EQ(channel.path, GltfPath::Weights);
  ASSERT_EQ(channel.values.rows(), 5);
  ASSERT_EQ(channel.values.cols(), 4);
  EXPECT_EQ(back.meshes[0].target_names[2], "frame 3");
  for (Index f = 0; f < 5; ++f) {
    EXPECT_NEAR(channel.times[static_cast<std::size_t>(f)], static_cast<double>(f) / 25, 1e-7);
    back.nodes[0].weights.assign(4, 0);
    for (Index t = 0; t < 4; ++t) {
      back.nodes[0].weights[static_cast<std::size_t>(t)] = channel.values(f, t);
    }
    const Mesh mesh = rest_mesh(back);
    EXPECT_LT((mesh.vertices - frames[static_cast<std::size_t>(f)].vertices).cwiseAbs().maxCoeff(),
              1e-6);
  }
}

/// The positions that weights of a channel's key give.
Points at_key(GltfScene scene, Index key) {
  const Eigen::VectorXd weights = scene.animations.at(0).channels.at(0).values.row(key);
  scene.nodes[0].weights.assign(weights.begin(), weights.end());
  return rest_mesh(scene).vertices;
}

TEST(GltfMorphs, LongSequence_IsFewShapesWithinTheStatedError) {
  // A ball that swings: three shapes at most.
  std::vector<Mesh> frames(200, fixtures::sphere(2));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const double t = 0.1 * static_cast<double>(f);
    frames[f].vertices.col(0).array() += std::sin(t) * frames[f].vertices.col(1).array().square();
    frames[f].vertices.col(2).array() += 0.5 * t + 0.2 * std::cos(t);
  }
  const GltfScene scene = gltf_morph_sequence(frames, 25, "cloth");
  ASSERT_EQ(scene.animations.size(), 1u);
  EXPECT_LE(scene.meshes[0].primitives[0].targets.size(), 4u);
  EXPECT_EQ(scene.meshes[0].target_names[0], "shape 1");
  EXPECT_LE(scene.animations[0].channels[0].values.cwiseAbs().maxCoeff(), 1 + 1e-12);
  for (const Index f : {0, 1, 77, 199}) {
    EXPECT_LT((at_key(scene, f) - frames[static_cast<std::size_t>(f)].vertices)
                  .rowwise()
                  .norm()
                  .maxCoeff(),
              1e-4)
        << f;
  }
  EXPECT_EQ(at_key(scene, 0), frames[0].vertices);
  ASSERT_EQ(scene.findings.size(), 1u);
  EXPECT_EQ(scene.findings[0].code, "gltf-shapes");
  EXPECT_THAT(scene.findings[0].what, HasSubstr("200 frames as sums of"));
}

TEST(GltfMorphs, FramesWithoutCommonShapes_SayHowFarTheyAreOff) {
  std::vector<Points> frames;
  std::srand(3);
  for (int f = 0; f < 20; ++f) {
    frames.emplace_back(Points::Random(12, 3));
  }
  EXPECT_EQ(gltf_morphs(frames, {}).error, 0) << "a target a frame";
  const GltfMorphs few = gltf_morphs(frames, {}, 5);
  ASSERT_EQ(few.targets.size(), 5u);
  double most = 0;
  for (Index f = 0; f < 20; ++f) {
    Points points = frames[0];
    for (Index t = 0; t < 5; ++t) {
      points += few.weights(f, t) * few.targets[static_cast<std::size_t>(t)].positions;
    }
    most =
        std::max(most, (points - frames[static_cast<std::size_t>(f)]).rowwise().norm().maxCoeff());
  }
  EXPECT_NEAR(few.error, most, 1e-12);
  EXPECT_GT(most, 0.1);
  const std::vector<Points> still(20, frames[0]);
  EXPECT_TRUE(gltf_morphs(still, {}, 5).targets.empty());
}

TEST(GltfMorphs, FramesWithoutNormals_GetThem) {
  const std::vector<Mesh> frames(3, fixtures::sphere(1));
  const GltfScene back = parse(glb_bytes(gltf_morph_sequence(frames, 25)));
  const GltfPrimitive& primitive = back.meshes[0].primitives[0];
  EXPECT_LT((primitive.mesh.normals - vertex_normals(frames[0].vertices, frames[0].faces))
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
  EXPECT_EQ(primitive.targets[1].normals.rows(), frames[0].vertices.rows());
}

TEST(ShowFirstKeys, Nodes_StandAsTheAnimationBegins) {
  GltfScene scene = bent_arm();
  scene.animations[0].channels[0].values.row(0) =
      Eigen::RowVector4d(0, 0, std::sqrt(0.5), std::sqrt(0.5));
  scene.nodes[1].rotation = {0, 0, 0, 1};
  show_first_keys(scene);
  const Eigen::RowVector3d hand = rest_mesh(scene).vertices.bottomRows(4).colwise().mean();
  EXPECT_LT((hand - Eigen::RowVector3d(1, 1, 0)).norm(), 1e-12);
}

TEST(WriteGltf, ConsentAndMaterial_AreInTheFile) {
  GltfScene scene = gltf_scene(fixtures::tetrahedron());
  scene.consent = "P. Doe, research, until 2030-12-31";
  const std::string text = glb_bytes(scene);
  EXPECT_THAT(text, HasSubstr("\"copyright\":\"Consent: P. Doe, research, until 2030-12-31\""));
  EXPECT_THAT(text, HasSubstr("{\"consent\":\"P. Doe, research, until 2030-12-31\"}"));
  // glTF's default material is a metal whose back is not drawn.
  EXPECT_THAT(text, HasSubstr("\"doubleSided\":true"));
  EXPECT_THAT(text, HasSubstr("\"metallicFactor\":0.0"));
}

TEST(GltfRoundTrip, EveryPathAndInterpolation_RoundTrips) {
  GltfScene scene = bent_arm();
  scene.nodes[0].matrix = Eigen::Matrix4d::Identity();
  (*scene.nodes[0].matrix)(1, 3) = 2;
  GltfChannel spline;
  spline.node = 1;
  spline.path = GltfPath::Translation;
  spline.interpolation = GltfInterpolation::CubicSpline;
  spline.times = {0.25, 0.5};
  spline.values = Eigen::MatrixXd::Random(6, 3).cast<float>().cast<double>();
  GltfChannel step;
  step.node = 1;
  step.path = GltfPath::Scale;
  step.interpolation = GltfInterpolation::Step;
  step.times = {0};
  step.values = Eigen::MatrixXd::Ones(1, 3);
  scene.animations.push_back({.name = "more", .channels = {spline, step}});
  const GltfScene back = parse(glb_bytes(scene));
  EXPECT_EQ(*back.nodes[0].matrix, *scene.nodes[0].matrix);
  EXPECT_EQ(back.animations[1].channels[0].values, spline.values);
  EXPECT_EQ(back.animations[1].channels[0].interpolation, GltfInterpolation::CubicSpline);
  EXPECT_EQ(back.animations[1].channels[1].path, GltfPath::Scale);
  EXPECT_EQ(back.animations[1].channels[1].interpolation, GltfInterpolation::Step);
}

TEST(RestMesh, BentJoint_MovesSkinnedVertices) {
  GltfScene scene = bent_arm();
  // The elbow bent by 90 degrees: the hand points up. The node of a skinned mesh does not count.
  scene.nodes[1].rotation = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};
  scene.nodes[2].translation = {9, 9, 9};
  const Mesh mesh = rest_mesh(scene);
  const Eigen::RowVector3d hand = mesh.vertices.bottomRows(4).colwise().mean();
  EXPECT_LT((hand - Eigen::RowVector3d(1, 1, 0)).norm(), 1e-12);
  EXPECT_LT(mesh.vertices.topRows(4).colwise().mean().norm(), 1e-12);
}

TEST(RestMesh, NodeTransforms_PlaceMeshesAndMirrorsFlipFaces) {
  GltfScene scene = gltf_scene(fixtures::tetrahedron());
  scene.meshes[0].primitives[0].mesh.normals =
      vertex_normals(fixtures::tetrahedron().vertices, fixtures::tetrahedron().faces);
  scene.nodes.resize(3);
  scene.nodes[1].parent = 0;
  scene.nodes[0].mesh = -1;
  scene.nodes[0].translation = {0, 5, 0};
  scene.nodes[1].mesh = 0;
  scene.nodes[1].scale = {-2, 2, 2};
  scene.nodes[2].mesh = 0;
  const Mesh one = rest_mesh(scene);
  EXPECT_EQ(one.vertices.rows(), 4);  // node 2 is in no scene
  EXPECT_EQ(one.vertices.row(0), Eigen::RowVector3d(-2, 7, 2));
  const Points outward = face_normals(one.vertices, one.faces);
  for (Index f = 0; f < 4; ++f) {
    const Eigen::RowVector3d centre =
        (one.vertices.row(one.faces(f, 0)) + one.vertices.row(one.faces(f, 1)) +
         one.vertices.row(one.faces(f, 2))) /
        3;
    EXPECT_GT(outward.row(f).dot(centre - Eigen::RowVector3d(0, 5, 0)), 0);
    EXPECT_GT(one.normals.row(one.faces(f, 0)).dot(outward.row(f)), 0);
  }
  scene.roots = {0, 2};
  EXPECT_EQ(rest_mesh(scene).vertices.rows(), 8);
  Limits limits;
  limits.mesh_vertices = 7;
  EXPECT_THROW(rest_mesh(scene, "", limits), DataError);
  scene.roots = {};
  EXPECT_THROW(rest_mesh(scene), DataError);
}

/// A .gltf of one triangle, for damage by replacement.
std::string triangle(const std::string& from = "", const std::string& to = "") {
  std::string text = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0,"children":[1]},{"name":"leaf"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":3}],
"buffers":[{"byteLength":39,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAEC"}]})";
  if (!from.empty()) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  return text;
}

TEST(ReadGltf, DataUriBuffer_IsRead) {
  const GltfScene scene = parse(triangle());
  const Mesh mesh = rest_mesh(scene);
  EXPECT_EQ(mesh.faces.row(0), Eigen::RowVector3i(0, 1, 2));
  EXPECT_EQ(mesh.vertices.row(2), Eigen::RowVector3d(0, 1, 0));
}

TEST(ReadGltf, StripsFansAndUnindexedMeshes_AreRead) {
  EXPECT_EQ(rest_mesh(parse(triangle("\"indices\":1", "\"mode\":5"))).faces.row(0),
            Eigen::RowVector3i(0, 1, 2));
  EXPECT_EQ(rest_mesh(parse(triangle("\"indices\":1", "\"mode\":6"))).faces.row(0),
            Eigen::RowVector3i(1, 2, 0));
  EXPECT_EQ(rest_mesh(parse(triangle(",\"indices\":1", ""))).faces.rows(), 1);
  const GltfScene lines = parse(triangle("\"indices\":1", "\"mode\":1"));
  EXPECT_TRUE(lines.meshes[0].primitives.empty());
  ASSERT_EQ(lines.findings.size(), 1u);
  EXPECT_EQ(lines.findings[0].code, "gltf-primitive");
}

TEST(ReadGltf, SparseAccessor_ReplacesElements) {
  // Vertex 1 moves to what vertex 2 holds; also on an accessor that has no view: zeros.
  const std::string sparse =
      "\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"byteOffset\":1,\"componentType\":"
      "5121},"
      "\"values\":{\"bufferView\":0,\"byteOffset\":24}}}";
  const Mesh moved =
      rest_mesh(parse(triangle("\"type\":\"VEC3\"}", "\"type\":\"VEC3\"," + sparse)));
  EXPECT_EQ(moved.vertices.row(1), Eigen::RowVector3d(0, 1, 0));
  const Mesh zeros = rest_mesh(
      parse(triangle("{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}",
                     "{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"," + sparse)));
  EXPECT_EQ(zeros.vertices.row(1), Eigen::RowVector3d(0, 1, 0));
  EXPECT_EQ(zeros.vertices.row(2), Eigen::RowVector3d(0, 0, 0));
  EXPECT_THAT(mesh_gltf_refusal(triangle(
                  "\"type\":\"VEC3\"}",
                  "\"type\":\"VEC3\",\"sparse\":{\"count\":4,\"indices\":{},\"values\":{}}}")),
              HasSubstr("accessors[0].sparse.count: 4"));
}

TEST(ReadGltf, PrimitiveThatIsCompressedAlone_IsRefused) {
  // The extension is used and, by the file, not required: without it the accessor has no numbers.
  const std::string numbers =
      "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}";
  std::string text = triangle(numbers, "{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}");
  const std::string extension =
      "\"extensions\":{\"KHR_draco_mesh_compression\":{\"bufferView\":0,\"attributes\":{}}},";
  text.insert(text.find("\"attributes\""), extension);
  EXPECT_THAT(
      mesh_gltf_refusal(text),
      HasSubstr("compressed by KHR_draco_mesh_compression alone; expected a file exported"));
  text = triangle(numbers, numbers);  // with numbers beside it, these are read
  text.insert(text.find("\"attributes\""), extension);
  EXPECT_EQ(rest_mesh(parse(text)).vertices.rows(), 3);
}

TEST(ReadGltf, MeshesThatANodeHides_AreLeftOutWithAWarning) {
  const std::string hides = "\"extensions\":{\"KHR_node_visibility\":{\"visible\":false}},";
  const std::string nodes = "{\"mesh\":0,\"children\":[1]},{\"name\":\"leaf\"}";
  // The leaf hides its own mesh; a parent hides the leaf's, too.
  const GltfScene one =
      parse(triangle(nodes, "{\"mesh\":0,\"children\":[1]},{" + hides + "\"mesh\":0}"));
  EXPECT_EQ(rest_mesh(one).vertices.rows(), 3);
  ASSERT_EQ(one.findings.size(), 1u);
  EXPECT_EQ(one.findings[0].code, "gltf-hidden");
  EXPECT_EQ(one.findings[0].severity, Severity::Warning);
  const GltfScene all =
      parse(triangle(nodes, "{" + hides + "\"mesh\":0,\"children\":[1]},{\"mesh\":0}"));
  EXPECT_EQ(all.findings.size(), 2u);
  EXPECT_THROW(rest_mesh(all), DataError) << "nothing is left to see";
}

TEST(ReadGltf, MeshesThatInstancesRepeat_AreSaidToBeReadOnce) {
  const GltfScene scene = parse(
      triangle("{\"mesh\":0,\"children\":[1]}",
               "{\"mesh\":0,\"children\":[1],\"extensions\":{\"EXT_mesh_gpu_instancing\":{}}}"));
  EXPECT_EQ(rest_mesh(scene).vertices.rows(), 3);
  ASSERT_EQ(scene.findings.size(), 1u);
  EXPECT_EQ(scene.findings[0].code, "gltf-instances");
}

TEST(ReadGltf, NormalizedIntegers_AreScaled) {
  const Mesh mesh = rest_mesh(
      parse(triangle("{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}",
                     "{\"bufferView\":0,\"componentType\":5122,\"normalized\":true,\"count\":3,"
                     "\"type\":\"VEC3\"}")));
  // Bytes 00 00 80 3F of 1.0f are the shorts 0 and 0x3F80.
  EXPECT_NEAR(mesh.vertices(2, 1), 0x3F80 / 32767.0, 1e-12);
}

TEST(ReadGltf, DamageInJson_IsRefused) {
  const struct {
    const char* from;
    const char* to;
    const char* words;
  } cases[] = {
      {"\"2.0\"", "\"1.0\"", "asset.version"},
      {"\"2.0\"", "2", "asset.version: number"},
      {"{\"asset\":{\"version\":\"2.0\"},", "{", "no \"asset\""},
      {"\"scene\":0", "\"scene\":1", "scene: 1; expected 0 to 0"},
      {"\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]",
       "'KHR_draco_mesh_compression'"},
      {"\"nodes\":[0]", "\"nodes\":[2]", "scenes[0].nodes[0]: 2"},
      {"\"nodes\":[0]", "\"nodes\":[1]", "which has a parent"},
      {"\"nodes\":[0]", "\"nodes\":[0,0]", "listed twice"},
      {"\"mesh\":0", "\"mesh\":1", "nodes[0].mesh: 1"},
      {"\"mesh\":0", "\"mesh\":-1", "nodes[0].mesh: -1"},
      {"\"mesh\":0", "\"mesh\":0.5", "nodes[0].mesh: 0.5"},
      {"\"mesh\":0", "\"mesh\":\"a\"", "nodes[0].mesh: string"},
      {"\"mesh\":0", "\"mesh\":0,\"skin\":0", "skin 0; expected one of 0"},
      {"\"mesh\":0", "\"mesh\":0,\"weights\":[1]", "1 weights"},
      {"\"mesh\":0", "\"rotation\":[0,0,0,0]", "a quaternion of length 0"},
      {"\"mesh\":0", "\"rotation\":[0,0,1]", "3 numbers; expected 4"},
      {"\"mesh\":0", "\"translation\":[0,0,\"x\"]", "nodes[0].translation[2]: string"},
      {"\"mesh\":0", "\"matrix\":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]", "affine"},
      {"\"children\":[1]", "\"children\":[0]", "which has a parent; expected a tree"},
      {"\"children\":[1]", "\"children\":[1,1]", "which has a parent; expected a tree"},
      {"\"children\":[1]", "\"children\":[7]", "nodes[0].children[0]: 7"},
      {"{\"name\":\"leaf\"}", "{\"children\":[0]}", "its own ancestor"},
      {"\"primitives\"", "\"p\"", "no \"primitives\""},
      {"\"POSITION\":0", "\"POSITION\":2", "POSITION: 2"},
      {"\"POSITION\":0", "\"POSITION\":1",
       "'SCALAR' for meshes[0].primitives[0].attributes.POSITION"},
      {"\"POSITION\":0", "\"POSITION\":0,\"JOINTS_0\":0", "both or none"},
      {"\"indices\":1", "\"indices\":0", "floating-point numbers for"},
      {"\"indices\":1", "\"mode\":7", "mode: 7"},
      {"\"count\":3,\"type\":\"VEC3\"", "\"count\":2,\"type\":\"VEC3\"",
       "index 2; expected below the 2"},
      {"\"count\":3,\"type\":\"VEC3\"", "\"count\":4,\"type\":\"VEC3\"", "4 elements of 12 bytes"},
      {"\"count\":3,\"type\":\"VEC3\"", "\"count\":4000000000,\"type\":\"VEC3\"", "4000000000"},
      {"\"count\":3,\"type\":\"VEC3\"", "\"count\":19000000,\"type\":\"VEC3\"",
       "too many for the bytes"},
      {"\"count\":3,\"type\":\"VEC3\"", "\"count\":-1,\"type\":\"VEC3\"", "accessors[0].count: -1"},
      {"\"count\":3,\"type\":\"VEC3\"", "\"type\":\"VEC3\"", "no \"count\""},
      {"\"count\":3,\"type\":\"SCALAR\"", "\"count\":2,\"type\":\"SCALAR\"",
       "2 corners of triangles"},
      {"\"componentType\":5126", "\"componentType\":5124", "5124"},
      {"\"componentType\":5126", "\"componentType\":1", "componentType: 1"},
      {"\"VEC3\"", "\"VEC5\"", "'VEC5'"},
      {"\"bufferView\":0", "\"bufferView\":2", "accessors[0].bufferView: 2"},
      {"\"bufferView\":0", "\"bufferView\":0,\"byteOffset\":1", "from byte 1 in a view of 36"},
      {"\"bufferView\":0", "\"bufferView\":0,\"byteOffset\":1099511627776",
       "from byte 1099511627776"},
      {"\"buffer\":0,\"byteLength\":36", "\"buffer\":1,\"byteLength\":36",
       "bufferViews[0].buffer: 1"},
      {"\"byteLength\":36", "\"byteLength\":40", "bytes 0 to 40 of a buffer of 39"},
      {"\"byteLength\":36", "\"byteLength\":36,\"byteStride\":3", "byteStride: 3"},
      {"\"byteLength\":36", "\"byteLength\":36,\"byteStride\":8", "a stride of 8"},
      {"\"byteLength\":36", "\"byteLength\":36,\"byteStride\":16", "3 elements of 12 bytes"},
      {"\"byteLength\":39", "\"byteLength\":40", "buffers[0]: 39 bytes; expected 40"},
      {"\"byteLength\":39", "\"byteLength\":39,\"byteLength\":39", "the key \"byteLength\" twice"},
      {";base64,", ",", "base64"},
      {"base64,AAAA", "base64,AA?A", "the digits of base64"},
      {"data:application/octet-stream;base64,", "http://host/a.bin?", "while reading from memory"},
      {"AACAPwAA", "AADAfwAA", "NaN or infinity"},
      {"\"asset\"",
       "\"animations\":[{\"samplers\":[],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,"
       "\"path\":\"scale\"}}]}],\"asset\"",
       "sampler: 0"},
      {"\"asset\"",
       "\"animations\":[{\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"color\"}}]}"
       "],\"asset\"",
       "'color'"},
      {"\"asset\"",
       "\"animations\":[{\"samplers\":[{\"input\":1,\"output\":0}],\"channels\":[{\"sampler\":0,"
       "\"target\":{\"node\":0,\"path\":\"weights\"}}]}],\"asset\"",
       "without morph targets"},
      {"\"asset\"",
       "\"animations\":[{\"samplers\":[{\"input\":1,\"output\":0}],\"channels\":[{\"sampler\":0,"
       "\"target\":{\"node\":0,\"path\":\"rotation\"}}]}],\"asset\"",
       "'VEC3' for animations[0].samplers[0].output"},
      {"\"asset\"", "\"skins\":[{\"joints\":[]}],\"asset\"", "0 joints"},
      {"\"asset\"", "\"skins\":[{\"joints\":[5]}],\"asset\"", "skins[0].joints[0]: 5"},
      {"\"asset\"", "\"skins\":[{\"joints\":[0],\"inverseBindMatrices\":0}],\"asset\"",
       "'VEC3' for"},
  };
  for (const auto& test : cases) {
    EXPECT_THAT(mesh_gltf_refusal(triangle(test.from, test.to)), HasSubstr(test.words)) << test.to;
  }
  EXPECT_THAT(mesh_gltf_refusal("glTF"), HasSubstr("version"));
  EXPECT_THAT(mesh_gltf_refusal(""), HasSubstr("an empty file; expected glTF 2.0"));
  const std::string cut = mesh_gltf_refusal("{");
  EXPECT_EQ(cut.find("; expected"), cut.rfind("; expected")) << cut;
  EXPECT_THAT(mesh_gltf_refusal("[]"), HasSubstr("array"));
}

TEST(ReadGltf, BrokenGlbContainer_IsRefused) {
  const std::string good = glb_bytes(gltf_scene(fixtures::tetrahedron()));
  for (std::size_t size = 4; size < good.size(); size += 7) {
    EXPECT_NE(mesh_gltf_refusal(good.substr(0, size)), "was read") << size;
  }
  EXPECT_THAT(mesh_gltf_refusal(good + "x"), HasSubstr("a length of"));
  std::string version = good;
  version[4] = 1;
  EXPECT_THAT(mesh_gltf_refusal(version), HasSubstr("GLB version 1"));
  std::string binary_first = good;
  binary_first.replace(16, 4, std::string("BIN\0", 4));
  EXPECT_THAT(mesh_gltf_refusal(binary_first), HasSubstr("another chunk"));
}

TEST(ReadGltf, SceneBeyondLimits_NamesTheLimit) {
  Limits limits;
  limits.mesh_vertices = 2;
  EXPECT_THAT(mesh_gltf_refusal(triangle(), limits),
              HasSubstr("accessors[0].count: 3; expected 0 to 2"));
  limits = {};
  limits.mesh_faces = 0;
  EXPECT_THAT(mesh_gltf_refusal(triangle(), limits), HasSubstr("accessors[1].count: 3"));
  limits = {};
  limits.mesh_file_bytes = 100;
  EXPECT_THAT(mesh_gltf_refusal(triangle(), limits), HasSubstr("at most 100"));
  limits = {};
  limits.joints = 1;
  EXPECT_THAT(mesh_gltf_refusal(glb_bytes(bent_arm()), limits),
              HasSubstr("2 joints; expected 1 to 1"));
}

TEST(ReadGltf, CoordinateBeyondLimit_NamesTheLimit) {
  Mesh mesh = fixtures::tetrahedron();
  mesh.vertices(2, 1) = 1e10;
  EXPECT_THAT(mesh_gltf_refusal(glb_bytes(gltf_scene(mesh))),
              HasSubstr("coordinate 1e+10; expected at most"));
  mesh.vertices(2, 1) = 1e8;
  GltfScene scene = gltf_scene(mesh);
  EXPECT_EQ(rest_mesh(scene).vertices.maxCoeff(), 1e8);
  scene.nodes[0].scale.setConstant(100);
  EXPECT_THROW(rest_mesh(scene), DataError);
}

TEST(ReadGltf, ExternalBuffers_StayInsideTheFolder) {
  const TemporaryDirectory folder;
  const std::filesystem::path inside = folder / "scene";
  std::filesystem::create_directories(inside / "parts");
  const std::string bytes(
      "\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\1\2", 39);
  std::ofstream(inside / "parts" / "a b.bin", std::ios::binary) << bytes;
  std::ofstream(folder / "outside.bin", std::ios::binary) << bytes;
  std::filesystem::create_symlink(folder / "outside.bin", inside / "link.bin");
  const auto read = [&](const std::string& uri) -> std::string {
    const std::string text = triangle();
    const std::size_t at = text.find("data:");
    std::string changed = text;
    changed.replace(at, text.find('"', at) - at, uri);
    std::ofstream(inside / "scene.gltf") << changed;
    try {
      return std::to_string(rest_mesh(read_gltf(inside / "scene.gltf")).faces.rows());
    } catch (const DataError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(read("parts/a%20b.bin"), "1");
  EXPECT_EQ(read("./parts/a b.bin"), "1");
  for (const char* uri :
       {"../outside.bin", "parts/../../outside.bin", "%2e%2e/outside.bin", "/etc/passwd",
        "file:///etc/passwd", "http://host/a.bin", "..\\\\outside.bin", "a%00.bin", ""}) {
    EXPECT_THAT(read(uri), HasSubstr("a relative path without")) << uri;
  }
  EXPECT_THAT(read("link.bin"), HasSubstr("a link out of the folder"));
  EXPECT_THAT(read("absent.bin"), HasSubstr("a file beside this one"));
  EXPECT_THAT(read("a%2.bin"), HasSubstr("hexadecimal"));
  EXPECT_THAT(read("parts"), HasSubstr("a folder"));
}

TEST(WriteGltf, InconsistentScene_IsRefused) {
  const TemporaryDirectory folder;
  EXPECT_THROW(write_gltf(folder / "a.obj", gltf_scene(fixtures::tetrahedron())), LogicError);
  EXPECT_THROW(write_gltf(folder / "absent" / "a.glb", gltf_scene(fixtures::tetrahedron())),
               EnvironmentError);
  GltfScene scene = bent_arm();
  scene.nodes[0].parent = 1;
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.nodes[1].parent = 7;
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.meshes[0].primitives[0].joints(0, 0) = 2;
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.meshes[0].primitives[0].weights.conservativeResize(3, 4);
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.skins[0].inverse_binds.pop_back();
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.animations[0].channels[0].times = {0, 0, 1};
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.animations[0].channels[0].times.pop_back();
  EXPECT_THROW(glb_bytes(scene), LogicError);
  scene = bent_arm();
  scene.roots = {3};
  EXPECT_THROW(glb_bytes(scene), LogicError);
  EXPECT_THROW(gltf_morph_sequence({}, 25), LogicError);
  EXPECT_THROW(gltf_morph_sequence({fixtures::tetrahedron()}, 0), LogicError);
  EXPECT_THROW(gltf_morph_sequence({fixtures::tetrahedron(), fixtures::sphere(1)}, 25), LogicError);
}

TEST(RealGltf, SkinnedFox_IsReadAndWritten) {
  ATELIER_TEST_FILE(path, "gltf_skinned/bevy_fox/Fox.glb");
  const GltfScene scene = read_gltf(path);
  EXPECT_EQ(scene.nodes.size(), 26u);
  EXPECT_EQ(scene.skins.at(0).joints.size(), 24u);
  ASSERT_EQ(scene.animations.size(), 3u);
  EXPECT_EQ(scene.animations[0].name, "Survey");
  const GltfPrimitive& primitive = scene.meshes.at(0).primitives.at(0);
  EXPECT_EQ(primitive.mesh.vertices.rows(), 1728);
  EXPECT_EQ(primitive.mesh.faces.rows(), 576);
  EXPECT_TRUE((primitive.weights.rowwise().sum().array() - 1).abs().maxCoeff() < 1e-3);
  check_mesh(rest_mesh(scene));
  // Written and read again: the same rest mesh.
  const GltfScene back = parse(glb_bytes(scene));
  EXPECT_LT((rest_mesh(back).vertices - rest_mesh(scene).vertices).cwiseAbs().maxCoeff(), 1e-3);
  ASSERT_EQ(back.animations.size(), 3u);
  EXPECT_EQ(back.animations[2].channels.size(), scene.animations[2].channels.size());
}

TEST(RealGltf, MorphTargets_AreRead) {
  ATELIER_TEST_FILE(path, "gltf_skinned/assimp_MorphStressTest/glTF/MorphStressTest.gltf");
  const GltfScene scene = read_gltf(path);
  EXPECT_EQ(scene.meshes.at(0).primitives.at(0).targets.size(), 8u);
  EXPECT_EQ(scene.meshes[0].target_names.size(), 8u);
  EXPECT_EQ(scene.animations.size(), 3u);
  EXPECT_EQ(scene.animations[0].channels.at(0).values.cols(), 8);
  ATELIER_TEST_FILE(sphere,
                    "gltf_skinned/assimp_AnimatedMorphSphere/glTF/AnimatedMorphSphere.gltf");
  EXPECT_EQ(read_gltf(sphere).meshes.at(0).primitives.at(0).targets.size(), 2u);
}

TEST(RealGltf, ThreeJointSetsAndNodeMatrices_AreRead) {
  ATELIER_TEST_FILE(path, "gltf_skinned/assimp_simple_skin/quad_skin.glb");
  const GltfScene scene = read_gltf(path);
  EXPECT_EQ(scene.meshes.at(0).primitives.at(0).joints.cols(), 12);
  EXPECT_TRUE(scene.nodes.at(1).matrix.has_value());
  ATELIER_TEST_FILE(simple, "gltf_skinned/assimp_simple_skin/simple_skin.gltf");
  EXPECT_EQ(read_gltf(simple).animations.at(0).channels.at(0).path, GltfPath::Rotation);
}

TEST(RealGltf, People_HaveHumanHeight) {
  for (const char* name : {"human-female", "human-male", "human-sophia", "model-human",
                           "m2m-custom-animation-success"}) {
    ATELIER_TEST_FILE(path, std::string("gltf_skinned/mesh2motion/") + name + ".glb");
    const Mesh mesh = read_mesh(path);
    const double height = mesh.vertices.col(1).maxCoeff() - mesh.vertices.col(1).minCoeff();
    EXPECT_GT(height, 1.4) << name;
    EXPECT_LT(height, 2.2) << name;
  }
  ATELIER_TEST_FILE(rig, "gltf_skinned/mesh2motion/rig-human.glb");
  EXPECT_EQ(read_gltf(rig).skins.at(0).joints.size(), 66u);
  EXPECT_THROW(read_mesh(rig), DataError);
}

}  // namespace
}  // namespace atelier
