// `atelier view` of meshes and of meshes over time that are no workspace's.

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/npz.h"
#include "core/io/one_file_sequence.h"
#include "core/io/usd_sequence.h"
#include "core/sequence_archive.h"
#include "tests/support/temporary_directory.h"
#include "tests/viewer/look.h"
#include "tests/viewer/page_scene.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// A square of side 1 m at a place along x, in two triangles.
Mesh square_at(double x) {
  Mesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << x, 0, 0, x + 1, 0, 0, x + 1, 1, 0, x, 1, 0;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3;
  return mesh;
}

std::vector<Mesh> moving_squares() {
  return {square_at(0), square_at(0.25), square_at(0.5)};
}

class ViewMeshes : public ::testing::Test {
 protected:
  fs::path at(const std::string& name) const { return folder_.path() / name; }
  /// The page's first timeline of a place; what the command said is in `said_`.
  nlohmann::json timeline_of(const fs::path& place) {
    const fs::path out = at("page" + std::to_string(pages_++));
    const ChildResult result = view({place.string(), "--out", out.string()});
    EXPECT_EQ(result.exit_code, 0) << place << result.err;
    said_ = result.out;
    return result.exit_code == 0 ? page_scene(out).at("timelines").at(0) : nlohmann::json();
  }
  TemporaryDirectory folder_;
  std::string said_;
  int pages_ = 0;
};

TEST_F(ViewMeshes, FilesOfASequence_AreShownWithTheirFramesAndRate) {
  const Sequence sequence = sequence_of(moving_squares(), 30, {3, 5, 6});
  write_one_file_sequence(at("T.h5"), sequence);
  write_usd_sequence(at("T.usda"), sequence, "T");
  write_sequence(at("folder"), sequence);
  for (const fs::path& place : {at("T.h5"), at("T.usda"), at("folder/sequence.h5")}) {
    const nlohmann::json timeline = timeline_of(place);
    EXPECT_EQ(timeline["frames"], nlohmann::json({3, 5, 6})) << place;
    EXPECT_EQ(timeline["takes"][0]["fps"], 30) << place;
    EXPECT_EQ(timeline["layers"][0]["vertices"], 4) << place << " is of one topology";
    EXPECT_THAT(said_, Not(HasSubstr("note:"))) << place;
  }
}

TEST_F(ViewMeshes, FoldersOfNumberedFiles_AreSequences) {
  for (const std::string ending : {".ply", ".obj", ".glb"}) {
    const fs::path folder = at("dress" + ending.substr(1));
    fs::create_directory(folder);
    for (int i = 0; i < 3; ++i) {
      write_mesh(folder / ("f-00001" + std::to_string(i) + ending), square_at(0.1 * i));
    }
    std::ofstream(folder / "readme.txt") << "x";
    const nlohmann::json timeline = timeline_of(folder);
    EXPECT_EQ(timeline["frames"], nlohmann::json({10, 11, 12})) << ending;
    EXPECT_EQ(timeline["layers"][0]["vertices"], 4) << ending;
    EXPECT_EQ(timeline["takes"][0]["fps"], 24) << ending;
    EXPECT_THAT(said_, HasSubstr("frames per second")) << ending;
  }
}

TEST_F(ViewMeshes, FramesOfDifferentTopologies_AreScans) {
  Mesh other = square_at(0);
  other.faces.row(0) << 1, 2, 3;
  for (const std::string name : {"ply", "h5"}) {
    fs::create_directory(at(name));
    const auto write = [&](const std::string& frame, const Mesh& mesh) {
      const fs::path file = at(name) / (frame + "." + name);
      name == "ply" ? write_mesh(file, mesh) : write_mesh_archive(file, mesh);
    };
    write("000001", square_at(0));
    write("000002", other);
    const nlohmann::json timeline = timeline_of(at(name));
    EXPECT_EQ(timeline["frames"], nlohmann::json({1, 2})) << name;
    EXPECT_EQ(timeline["layers"][0]["role"], "scan") << name;
    EXPECT_EQ(timeline["layers"][0]["topology"], false) << name;
  }
}

TEST_F(ViewMeshes, OptionsThatDoNothing_AreRefusedByTheirFlags) {
  fs::create_directory(at("dress"));
  write_mesh(at("dress/000001.obj"), square_at(0));
  const auto refused = [&](const std::string& flag, const std::string& value) {
    const ChildResult result = view({at("dress").string(), flag, value, "--out", at("p").string()});
    EXPECT_EQ(result.exit_code, kExitUsage) << flag << result.out;
    EXPECT_FALSE(fs::exists(at("p")));
    return result.err;
  };
  EXPECT_THAT(refused("--layout", "native"),
              AllOf(HasSubstr("--layout does nothing"), HasSubstr("capture")));
  EXPECT_THAT(refused("--capture.layout", "native"), HasSubstr("--capture.layout does nothing"));
  EXPECT_THAT(refused("--image-width", "640"), HasSubstr("--image-width does nothing"));
}

TEST_F(ViewMeshes, OneMeshOfAnArchive_IsShown) {
  write_mesh_archive(at("one.h5"), square_at(0));
  EXPECT_EQ(timeline_of(at("one.h5"))["name"], "Mesh");
}

TEST_F(ViewMeshes, AnimatedScene_SaysThatItStandsStill) {
  write_gltf(at("moves.glb"), gltf_morph_sequence(moving_squares(), 30, "moves"));
  timeline_of(at("moves.glb"));
  EXPECT_THAT(said_, AllOf(HasSubstr("note: moves.glb is animated"), HasSubstr("first pose")));
  write_mesh(at("still.glb"), square_at(0));
  timeline_of(at("still.glb"));
  EXPECT_THAT(said_, Not(HasSubstr("note:")));
}

TEST_F(ViewMeshes, UnknownUnit_IsNotedWithTheOptionForIt) {
  std::ofstream(at("cube mm.obj")) << "v 0 0 0\nv 900 0 0\nv 0 900 0\nf 1 2 3\n";
  timeline_of(at("cube mm.obj"));
  EXPECT_THAT(said_, AllOf(HasSubstr("does not say its unit"), HasSubstr("--input.unit")));
}

TEST_F(ViewMeshes, UnitAndUpAxisThatFilesDoNotSay_AreThoseOfTheOptions) {
  const std::string text = "v 0 0 500\nv 1000 0 500\nv 0 0 1500\nf 1 2 3\n";
  std::ofstream(at("lies.obj")) << text;
  fs::create_directory(at("lies"));
  std::ofstream(at("lies/000001.obj")) << text;
  std::ofstream(at("lies/000002.obj")) << text;
  const std::vector<float> vertices = {0, 0, 500, 1000, 0, 500, 0, 0, 1500};
  write_npz(at("lies.npz"), {{"vertices", tensor_of(vertices, {1, 3, 3})},
                             {"faces", tensor_of(std::vector<int>{0, 1, 2}, {1, 3})}});
  for (const std::string name : {"lies.obj", "lies", "lies.npz"}) {
    const fs::path out = at("page of " + name);
    const ChildResult result =
        view({at(name).string(), "--input.up", "z", "--input.unit", "mm", "--out", out.string()});
    ASSERT_EQ(result.exit_code, 0) << name << result.err;
    int files = 0;  // with a corner of their box at half a metre of height
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out / "data")) {
      if (!entry.is_regular_file()) {
        continue;
      }
      std::ifstream file(entry.path());
      const std::string data{std::istreambuf_iterator<char>(file), {}};
      files += data.find("\"low\":[0.0,0.5,") != std::string::npos ? 1 : 0;
    }
    EXPECT_GT(files, 0) << name;
  }
  fs::create_directory(at("sequence"));
  write_sequence(at("sequence/dress"), sequence_of(moving_squares(), 30, {3, 5, 6}));
  const ChildResult refused = view({at("sequence").string(), "--input.up", "z", "--out", "p"});
  EXPECT_EQ(refused.exit_code, kExitUsage);
  EXPECT_THAT(refused.err, HasSubstr("--input.up does nothing"));
}

TEST_F(ViewMeshes, UpAxisThatAFileSays_IsKeptAndTheOptionIsNoted) {
  fs::create_directory(at("says"));
  for (const char* name : {"says.obj", "says/000001.obj", "says/000002.obj"}) {
    std::ofstream(at(name)) << "# up: y\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  }
  for (const std::string name : {"says.obj", "says"}) {
    const fs::path out = at("page that " + name);
    const ChildResult result =
        view({at(name).string(), "--input.up", "z", "--input.unit", "m", "--out", out.string()});
    ASSERT_EQ(result.exit_code, 0) << name << result.err;
    EXPECT_THAT(result.out, HasSubstr("says which axis is up: --input.up does nothing"));
    EXPECT_THAT(result.out, Not(HasSubstr("--input.unit does nothing")));
  }
}

TEST_F(ViewMeshes, WordsOfOtherPrograms_AreNotedAndTheMeshIsShown) {
  std::ofstream(at("cloth.obj")) << "v 0 0 0\nvv 0 0 0\nv 1 0 0\nvv 0 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(timeline_of(at("cloth.obj"))["layers"][0]["name"], "cloth");
  EXPECT_THAT(said_, HasSubstr("note: cloth.obj: 2 lines with an unknown word are skipped: 'vv'"));
}

TEST_F(ViewMeshes, BodyAndClothOfOneFile_AreTwoLayers) {
  const Tensor vertices = tensor_of(std::vector<float>(18, 0.5F), {2, 3, 3});
  const Tensor faces = tensor_of(std::vector<int>{0, 1, 2}, {1, 3});
  const auto roles_of = [&](const nlohmann::json& timeline) {
    std::vector<std::string> roles;
    for (const nlohmann::json& layer : timeline["layers"]) {
      roles.push_back(layer["name"].get<std::string>() + ": " + layer["role"].get<std::string>());
    }
    return roles;
  };
  write_npz(at("both.npz"), {{"body_vertices", vertices},
                             {"body_faces", faces},
                             {"cloth_vertices", vertices},
                             {"cloth_faces", faces}});
  EXPECT_THAT(roles_of(timeline_of(at("both.npz"))), ElementsAre("body: body", "cloth: garment"));
  write_npz(at("alone.npz"), {{"body_vertices", vertices}, {"body_faces", faces}});
  EXPECT_THAT(roles_of(timeline_of(at("alone.npz"))), ElementsAre("body: body"));
  write_npz(at("cloth.npz"), {{"cloth_vertices", vertices}, {"cloth_faces", faces}});
  EXPECT_THAT(roles_of(timeline_of(at("cloth.npz"))), ElementsAre("cloth: garment"));
}

TEST_F(ViewMeshes, WhatIsNoMesh_IsRefusedWithWhatIsTaken) {
  const auto refused = [&](const fs::path& place) {
    const ChildResult result = view({place.string(), "--out", at("p").string()});
    EXPECT_EQ(result.exit_code, kExitBadData) << place << result.out;
    return result.err;
  };
  std::ofstream(at("a.abc")) << "x";
  EXPECT_THAT(refused(at("a.abc")), AllOf(HasSubstr(".usda"), HasSubstr("a folder of numbered")));
  fs::create_directory(at("names"));
  write_mesh(at("names/dress.ply"), square_at(0));
  EXPECT_THAT(refused(at("names")), AllOf(HasSubstr("dress.ply"), HasSubstr("frame number")));
  std::ofstream(at("b.h5")) << "x";
  EXPECT_THAT(refused(at("b.h5")), HasSubstr("b.h5"));
}

}  // namespace
}  // namespace atelier::fixtures
