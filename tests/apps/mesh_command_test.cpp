// `convert` and `render`.

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "tests/apps/program_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

using MeshCommand = Program;

TEST_F(MeshCommand, FolderAsMesh_IsRefused) {
  expect_refusal(run({"convert", root_.path().string(), "b.obj"}), 3,
                 "a folder; expected a mesh file");
}

TEST_F(MeshCommand, ConvertedMesh_KeepsItsContent) {
  write_boxes(input(), 1);
  const std::string ply = (root_ / "box.ply").string();
  const ChildResult result =
      run({"convert", (input() / "box_000.obj").string(), ply, "--input.unit", "cm"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("8 vertices, 12 faces"));
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("highest           0.01 0.01 0.01"));
}

TEST_F(MeshCommand, ControlCharactersInNames_AreNotShown) {
  write_boxes(input(), 1);
  const std::string box = (input() / "box_000.obj").string();
  const ChildResult mesh = run({"convert", box, (root_ / "a\x1b[31m.ply").string()});
  EXPECT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_THAT(mesh.out, HasSubstr("a?[31m.ply: 8 vertices"));
  const ChildResult picture = run({"render", box, "--width", "16", "--height", "16", "--out",
                                   (root_ / "a\x1b[31m.png").string()});
  if (picture.exit_code == 0) {  // else it is built without images
    EXPECT_THAT(picture.out, HasSubstr("a?[31m.png: 16 x 16"));
  }
}

TEST_F(MeshCommand, OmittedContent_IsReported) {
  Mesh mesh;
  mesh.vertices = Points::Random(3, 3);
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  GltfScene scene = gltf_scene(mesh, "cape");
  scene.meshes[0].primitives[0].targets = {{Points::Ones(3, 3), Points(0, 3)}};
  scene.animations.push_back({"sway",
                              {{0,
                                GltfPath::Translation,
                                GltfInterpolation::Linear,
                                {0, 1.5},
                                Eigen::MatrixXd::Zero(2, 3)}}});
  write_gltf(root_ / "cape.glb", scene);
  const std::string ply = (root_ / "cape.ply").string();
  EXPECT_THAT(run({"convert", (root_ / "cape.glb").string(), ply}).out,
              HasSubstr("left out, since OUT is a mesh at rest: 1 animation, 1 blend shape;"));
  mesh.labels = {1, 2, 3};
  write_mesh(ply, mesh);
  EXPECT_THAT(run({"convert", ply, (root_ / "cape.obj").string()}).out,
              HasSubstr("left out, since .obj has no place for it: labels; .ply has"));
  EXPECT_THAT(run({"convert", ply, (root_ / "same.ply").string()}).out,
              ::testing::Not(HasSubstr("left out")));
}

TEST_F(MeshCommand, Render_WritesAnImage) {
  if (run({"--help"}).out.find("render") == std::string::npos) {
    GTEST_SKIP() << "built without core_render";
  }
  write_boxes(input(), 1);
  const std::string png = (root_ / "box.png").string();
  const ChildResult result = run({"render", (input() / "box_000.obj").string(), "--out", png,
                                  "--width", "64", "--height", "48", "--samples", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(run({"inspect", png}).out,
              AllOf(HasSubstr("width             64 px"), HasSubstr("height            48 px")));
  const std::string jpg = (root_ / "box.JPG").string();
  EXPECT_EQ(run({"render", (input() / "box_000.obj").string(), "--out", jpg, "--width", "64",
                 "--height", "48", "--samples", "1"})
                .exit_code,
            0);
  EXPECT_THAT(run({"inspect", jpg}).out, HasSubstr("image, JPEG"));
  expect_refusal(run({"render", (input() / "box_000.obj").string(), "--out", "box.gif"}),
                 kExitUsage, "it takes a name with .png, .jpg");
  expect_refusal(
      run({"render", (input() / "box_000.obj").string(), "--out", "box.png", "--azimuth", "nan"}),
      kExitUsage, "azimuth cannot be 'nan': it takes a number in [-360, 360] (degrees)");
}

TEST_F(MeshCommand, UnknownUnit_IsReported) {
  write_boxes(input(), 1);
  const std::string box = (input() / "box_000.obj").string();
  const std::string ply = (root_ / "box.ply").string();
  EXPECT_THAT(run({"convert", box, ply}).out, HasSubstr("IN does not say its unit"));
  EXPECT_THAT(run({"inspect", box}).out, HasSubstr("taken for metres: the file does not say"));
  EXPECT_THAT(run_statistics({}).err, ::testing::Not(HasSubstr("unit")));
  const std::string again = (root_ / "again.ply").string();
  EXPECT_THAT(run({"convert", ply, again}).out, ::testing::Not(HasSubstr("unit")));
  // What is given is not asked for, and what does nothing is refused.
  EXPECT_THAT(run({"convert", box, again, "--input.unit", "m"}).out,
              ::testing::Not(HasSubstr("does not say")));
  const std::string glb = (root_ / "box.glb").string();
  ASSERT_EQ(run({"convert", box, glb}).exit_code, 0);
  const std::string unwritten = (root_ / "unwritten.ply").string();
  for (const std::string& says : {ply, glb}) {
    expect_refusal(run({"convert", says, unwritten, "--input.unit", "mm"}), kExitUsage,
                   "--input.unit does nothing: IN says its unit");
    expect_refusal(run({"convert", says, unwritten, "--input.up", "z"}), kExitUsage,
                   "--input.up does nothing: IN says which axis is up");
    expect_refusal(run({"render", says, "--input.up", "z", "--out", (root_ / "a.png").string()}),
                   kExitUsage, "--input.up does nothing: MESH says which axis is up");
  }
  EXPECT_FALSE(std::filesystem::exists(unwritten));
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("as the file says, here in metres"));
  // A person in millimetres.
  std::ofstream(input() / "box_000.obj") << "v 0 0 0\nv 0 1800 0\nv 500 0 0\nf 1 2 3\n";
  const std::string warning =
      "the file does not say its unit, and as it is taken the mesh is 1800 m "
      "large; ";
  EXPECT_THAT(run({"convert", box, ply}).out,
              AllOf(HasSubstr("warning unit-unknown [" + box + "]: " + warning + "--input.unit"),
                    ::testing::Not(HasSubstr("IN does not say"))));
  EXPECT_THAT(run({"inspect", box}).out, HasSubstr(warning + "convert IN OUT --input.unit"));
  EXPECT_THAT(run_statistics({}).err, HasSubstr(warning));
  EXPECT_THAT(run({"convert", box, ply, "--input.unit", "mm"}).out,
              ::testing::Not(HasSubstr("warning")));
}

TEST_F(MeshCommand, MissingFrameNumbers_AreNoted) {
  write_boxes(input(), 3);
  std::filesystem::remove(input() / "box_001.obj");
  EXPECT_THAT(run_statistics({}).err,
              HasSubstr("note frame-numbers-missing [" + input().string() +
                        "]: numbers without a mesh: 1; copy what is missing"));
}

TEST_F(MeshCommand, ConvertOptions_ComeFromFilesAndFlags) {
  write_boxes(input(), 1);
  const std::string box = (input() / "box_000.obj").string();
  const std::string file = (root_ / "box.toml").string();
  const std::string ply = (root_ / "box.ply").string();
  std::ofstream(file) << "[input]\nunit = \"mm\"\n";
  ASSERT_EQ(run({"convert", box, ply, "--config", file}).exit_code, 0);
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("highest           0.001 0.001 0.001"));
  ASSERT_EQ(run({"convert", box, ply, "--config", file, "--input.unit=dm"}).exit_code, 0);
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("highest           0.1 0.1 0.1"));
  std::ofstream(file) << "[input]\nunits = \"mm\"\n";
  expect_refusal(run({"convert", box, ply, "--config", file}), kExitUsage,
                 "box.toml:2: there is no option 'input.units', did you mean 'input.unit'?");
}

}  // namespace
}  // namespace atelier::fixtures
