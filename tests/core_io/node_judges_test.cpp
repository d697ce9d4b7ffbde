// Outside judges of npm (tests/judges): three.js, Khronos' glTF validator and glTF Transform open
// what we write. Each test skips where its judge is not installed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/mesh_gltf.h"
#include "core/io/mesh_ply.h"
#include "core/io/usd_sequence.h"
#include "core/sequence.h"
#include "tests/support/outside_judge.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::judged;
using fixtures::Judgement;
using ::testing::ElementsAre;

/// A ball that grows by 0.01 m a frame and moves.
std::vector<Mesh> growing_ball(int count) {
  std::vector<Mesh> frames;
  for (int f = 0; f < count; ++f) {
    frames.push_back(fixtures::sphere(2));
    frames.back().vertices *= 1 + 0.01 * f;
    frames.back().vertices.col(0).array() += 0.1 * f;
  }
  return frames;
}

void expect_box(const std::vector<double>& found, const Points& points, double tolerance) {
  ASSERT_EQ(found.size(), 6U);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    EXPECT_NEAR(found[a], points.col(axis).minCoeff(), tolerance);
    EXPECT_NEAR(found[3 + a], points.col(axis).maxCoeff(), tolerance);
  }
}

TEST(ThreeJs, MorphSequence_PlaysEveryFrameWithNormalsAndFromBothSides) {
  ATELIER_NEEDS_JUDGE("three");
  const fixtures::TemporaryDirectory folder;
  const std::vector<Mesh> frames = growing_ball(3);
  write_gltf(folder / "a.glb", gltf_morph_sequence(frames, 4, "dress"));
  const Judgement found = judged("three.mjs", {"gltf", (folder / "a.glb").string(), "0.25", "0.5"});
  // Metalness, sides, normals, targets, targets with normals, influences of a skin.
  EXPECT_THAT(found.at("mesh:dress"), ElementsAre(0, 2, 1, 2, 2, 0));
  EXPECT_THAT(found.at("clips"), ElementsAre(1));
  expect_box(found.at("dress@rest"), frames[0].vertices, 1e-6);
  expect_box(found.at("dress@0.25"), frames[1].vertices, 1e-6);
  expect_box(found.at("dress@0.5"), frames[2].vertices, 1e-6);
}

TEST(ThreeJs, LongMorphSequence_HasFewTargetsAndStillPlays) {
  ATELIER_NEEDS_JUDGE("three");
  const fixtures::TemporaryDirectory folder;
  const std::vector<Mesh> frames = growing_ball(90);
  write_gltf(folder / "a.glb", gltf_morph_sequence(frames, 8, "dress"));
  const Judgement found = judged("three.mjs", {"gltf", (folder / "a.glb").string(), "5", "11"});
  EXPECT_LE(found.at("mesh:dress")[3], kMostMorphTargets);
  expect_box(found.at("dress@rest"), frames[0].vertices, 1e-6);
  expect_box(found.at("dress@5"), frames[40].vertices, 1.1e-4);
  expect_box(found.at("dress@11"), frames[88].vertices, 1.1e-4);
}

TEST(ThreeJs, WrittenPly_HasEveryTriangle) {
  ATELIER_NEEDS_JUDGE("three");
  const fixtures::TemporaryDirectory folder;
  const Mesh ball = fixtures::sphere(2);
  write_ply(folder / "a.ply", ball);
  const Judgement found = judged("three.mjs", {"ply", (folder / "a.ply").string()});
  const std::vector<double>& ply = found.at("ply");
  EXPECT_EQ(ply[0], static_cast<double>(ball.vertices.rows()));
  EXPECT_EQ(ply[1], static_cast<double>(ball.faces.rows()));
  expect_box({ply.begin() + 2, ply.end()}, ball.vertices, 1e-6);
}

TEST(ThreeJs, WrittenUsd_ShowsTheFirstFrame) {
  ATELIER_NEEDS_JUDGE("three");
  const fixtures::TemporaryDirectory folder;
  const std::vector<Mesh> frames = growing_ball(3);
  write_usd_sequence(folder / "a.usda", sequence_of(frames, 24, {7, 8, 9}), "dress");
  const Judgement found = judged("three.mjs", {"usd", (folder / "a.usda").string()});
  expect_box(found.at("dress@rest"), frames[0].vertices, 1e-6);
}

TEST(GltfValidator, WhatIsWritten_HasNoErrorAndNoWarning) {
  ATELIER_NEEDS_JUDGE("gltf-validator");
  const fixtures::TemporaryDirectory folder;
  Mesh textured = fixtures::sphere(2);
  textured.uvs = textured.vertices.leftCols(2);
  textured.uv_faces = textured.faces;
  textured.colors = Colors::Constant(textured.vertices.rows(), 3, 0.5F);
  textured.normals = Points::Zero(textured.vertices.rows(), 3);  // no unit vectors
  GltfScene plain = gltf_scene(textured);
  plain.consent = "P. Doe, research";
  write_gltf(folder / "plain.glb", plain);
  write_gltf(folder / "text.gltf", plain);
  write_gltf(folder / "morph.glb", gltf_morph_sequence(growing_ball(3), 25, "dress"));
  write_gltf(folder / "long.glb", gltf_morph_sequence(growing_ball(70), 25, "dress"));
  for (const char* name : {"plain.glb", "text.gltf", "morph.glb", "long.glb"}) {
    const Judgement found = judged("gltf_validator.mjs", {(folder / name).string()});
    EXPECT_THAT(found.at("errors"), ElementsAre(0)) << name << ::testing::PrintToString(found);
    EXPECT_THAT(found.at("warnings"), ElementsAre(0)) << name << ::testing::PrintToString(found);
  }
}

TEST(GltfTransform, Bounds_AreThoseOfTheMesh) {
  ATELIER_NEEDS_JUDGE("@gltf-transform/core");
  const fixtures::TemporaryDirectory folder;
  const Mesh ball = fixtures::sphere(2);
  write_gltf(folder / "a.glb", gltf_scene(ball, "ball"));
  const Judgement found = judged("gltf_transform.mjs", {(folder / "a.glb").string()});
  expect_box(found.at("bounds"), ball.vertices, 1e-6);
  EXPECT_TRUE(found.contains("mesh:ball"));
}

}  // namespace
}  // namespace atelier
