// Programs of others read what we write. Each test skips where its program is not installed.

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/mesh_obj.h"
#include "core/io/mesh_ply.h"
#include "core/io/one_file_sequence.h"
#include "core/sequence.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::TemporaryDirectory;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

/// What a command prints, "" if it fails.
std::string output_of(const std::string& command) {
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) {
    return "";
  }
  std::string output;
  std::array<char, 4096> part{};
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe)) {
    output.append(part.data(), count);
  }
  const int status = pclose(pipe);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? output : "";
}

std::string assimp_info(const std::filesystem::path& file) {
  return output_of("assimp info '" + file.string() + "'");
}

class Assimp : public ::testing::Test {
 protected:
  void SetUp() override {
    if (output_of("assimp version").empty()) {
      GTEST_SKIP() << "no program assimp (package assimp-utils)";
    }
  }
  TemporaryDirectory folder_;
};

Mesh ball() {
  Mesh mesh = fixtures::sphere(2);
  mesh.normals = mesh.vertices;
  mesh.colors = Colors::Constant(mesh.vertices.rows(), 3, 0.5F);
  mesh.uvs = mesh.vertices.leftCols(2);
  mesh.uv_faces = mesh.faces;
  return mesh;
}

TEST_F(Assimp, WrittenObjAndPly_AreReadByAssimp) {
  const Mesh mesh = ball();
  write_obj(folder_ / "a.obj", mesh);
  write_ply(folder_ / "text.ply", mesh, {.format = PlyFormat::Ascii});
  write_ply(folder_ / "little.ply", mesh);
  write_ply(folder_ / "big.ply", mesh, {.format = PlyFormat::BinaryBigEndian});
  write_ply(folder_ / "exact.ply", mesh, {.exact = true});
  for (const char* name : {"a.obj", "text.ply", "little.ply", "big.ply", "exact.ply"}) {
    const std::string info = assimp_info(folder_ / name);
    EXPECT_THAT(info, ContainsRegex("Faces: +128\n")) << name;
    EXPECT_THAT(info, HasSubstr("Minimum point      (-1.000000 -1.000000 -1.000000)")) << name;
    EXPECT_THAT(info, HasSubstr("Maximum point      (1.000000 1.000000 1.000000)")) << name;
  }
}

TEST_F(Assimp, WrittenGltf_IsReadByAssimp) {
  write_gltf(folder_ / "a.glb", gltf_scene(ball()));
  write_gltf(folder_ / "a.gltf", gltf_scene(ball()));
  for (const char* name : {"a.glb", "a.gltf"}) {
    const std::string info = assimp_info(folder_ / name);
    EXPECT_THAT(info, ContainsRegex("Vertices: +66\n")) << name;
    EXPECT_THAT(info, ContainsRegex("Faces: +128\n")) << name;
  }
  std::vector<Mesh> frames(4, ball());
  frames[2].vertices *= 2;
  write_gltf(folder_ / "morph.glb", gltf_morph_sequence(frames, 30));
  const std::string info = assimp_info(folder_ / "morph.glb");
  EXPECT_THAT(info, ContainsRegex("Animations: +1\n"));
  EXPECT_THAT(info, ContainsRegex("Vertices: +66\n"));
}

/// PLY cannot hold it (assimp 5.2.5 takes one coordinate a vertex): of textured garments the advice
/// is OBJ or glTF.
TEST_F(Assimp, TextureSeamsOfObjAndGltf_KeepTheCoordinateOfEachCorner) {
  Mesh mesh = ball();
  mesh.uvs.resize(3 * mesh.faces.rows(), 2);
  mesh.uv_faces.resize(mesh.faces.rows(), 3);
  for (Index corner = 0; corner < 3 * mesh.faces.rows(); ++corner) {  // a seam at every edge
    mesh.uvs.row(corner) << static_cast<double>(corner % 24) / 32,
        static_cast<double>(corner / 24) / 32;  // exact in float
    mesh.uv_faces(corner / 3, corner % 3) = static_cast<int>(corner);
  }
  write_obj(folder_ / "a.obj", mesh);
  write_gltf(folder_ / "a.glb", gltf_scene(mesh));
  for (const char* name : {"a.obj", "a.glb"}) {
    SCOPED_TRACE(name);
    ASSERT_NE(output_of("assimp export '" + (folder_ / name).string() + "' '" +
                        (folder_ / "a.assjson").string() + "' -fassjson"),
              "");
    const nlohmann::json read =
        nlohmann::json::parse(read_file_text(folder_ / "a.assjson", 1 << 24))["meshes"][0];
    ASSERT_EQ(std::ssize(read["faces"]), mesh.faces.rows());
    for (Index face = 0; face < mesh.faces.rows(); ++face) {
      for (int c = 0; c < 3; ++c) {
        const auto v = read["faces"][static_cast<std::size_t>(face)][static_cast<std::size_t>(c)]
                           .get<std::size_t>();
        const Eigen::RowVector3d place(read["vertices"][3 * v].get<double>(),
                                       read["vertices"][3 * v + 1].get<double>(),
                                       read["vertices"][3 * v + 2].get<double>());
        const Eigen::RowVector2d uv(read["texturecoords"][0][2 * v].get<double>(),
                                    read["texturecoords"][0][2 * v + 1].get<double>());
        ASSERT_LT((place - mesh.vertices.row(mesh.faces(face, c))).norm(), 1e-5) << face;
        ASSERT_LT((uv - mesh.uvs.row(mesh.uv_faces(face, c))).norm(), 1e-5) << face;
      }
    }
  }
}

TEST_F(Assimp, RewrittenSkinnedPerson_LooksTheSameToAssimp) {
  ATELIER_TEST_FILE(path, "gltf_skinned/mesh2motion/m2m-custom-animation-success.glb");
  write_gltf(folder_ / "a.glb", read_gltf(path));
  const std::string theirs = assimp_info(path);
  const std::string ours = assimp_info(folder_ / "a.glb");
  for (const char* key : {"Vertices: ", "Faces: ", "Bones: ", "Animations: ", "Animation Channels:",
                          "Minimum point", "Maximum point"}) {
    const auto line = [&](const std::string& info) {
      const std::size_t at = info.find(key);
      return at == std::string::npos ? "" : info.substr(at, info.find('\n', at) - at);
    };
    EXPECT_NE(line(ours), "") << key;
    EXPECT_EQ(line(ours), line(theirs));
  }
}

/// Prints format, mode, size and first pixels of an image as Pillow sees them.
std::string pillow_view(const std::filesystem::path& file) {
  return output_of(
      "/usr/bin/python3 -c \"from PIL import Image; import sys; i = Image.open(sys.argv[1]); "
      "print(i.format, i.mode, i.size, list(i.getdata())[:4])\" '" +
      file.string() + "'");
}

/// Counts, and the corners of the box, of a mesh as Open3D has it.
std::string open3d_view(const std::filesystem::path& file) {
  return output_of(
      "/usr/bin/python3 -c \"import open3d, sys; m = open3d.io.read_triangle_mesh(sys.argv[1]); "
      "print(len(m.triangles), *(round(float(c), 4) for b in (m.get_min_bound(), "
      "m.get_max_bound()) for c in b))\" '" +
      file.string() + "'");
}

TEST(Open3d, WrittenMeshes_AreReadByOpen3d) {
  if (output_of("/usr/bin/python3 -c 'import open3d'; echo $?") != "0\n") {
    GTEST_SKIP() << "no Open3D (package python3-open3d)";
  }
  const TemporaryDirectory folder;
  const Mesh mesh = ball();  // of triangles: of quads in OBJ Open3D takes none
  write_obj(folder / "a.obj", mesh);
  write_ply(folder / "a.ply", mesh);
  write_gltf(folder / "a.glb", gltf_scene(mesh));
  for (const char* name : {"a.obj", "a.ply", "a.glb"}) {
    EXPECT_THAT(open3d_view(folder / name), HasSubstr("128 -1.0 -1.0 -1.0 1.0 1.0 1.0")) << name;
  }
}

TEST(H5py, TextOfAWrittenSequence_IsStr) {
  if (output_of("/usr/bin/python3 -c 'import h5py'; echo $?") != "0\n") {
    GTEST_SKIP() << "no h5py (package python3-h5py)";
  }
  const TemporaryDirectory folder;
  write_one_file_sequence(folder / "a.h5", sequence_of({ball(), ball()}, 24, {7, 8}));
  const std::string said = output_of(
      "/usr/bin/python3 -c \"import h5py, sys; f = h5py.File(sys.argv[1]); "
      "print(*[key for key, value in f.attrs.items() if isinstance(value, bytes)], "
      "isinstance(f.attrs['units'], str), f['vertices'].shape[0])\" '" +
      (folder / "a.h5").string() + "'");
  EXPECT_EQ(said, "True 2\n");
}

/// Open3D writes PLY of doubles.
TEST(Open3d, PlyOfDoublesThatOpen3dWrites_ReadsBackToTheSameBits) {
  if (output_of("/usr/bin/python3 -c 'import open3d'; echo $?") != "0\n") {
    GTEST_SKIP() << "no Open3D (package python3-open3d)";
  }
  const TemporaryDirectory folder;
  Mesh mesh = fixtures::sphere(2);
  mesh.vertices.array() *= 1.0 / 3;  // no floats
  write_ply(folder / "ours.ply", mesh, {.exact = true});
  const std::string judge =
      (fixtures::source_directory() / "tests/judges/open3d_judge.py").string();
  ASSERT_NE(output_of("/usr/bin/python3 '" + judge + "' '" + (folder / "ours.ply").string() +
                      "' '" + (folder / "theirs.ply").string() + "'"),
            "");
  const std::string header = read_file_text(folder / "theirs.ply", 1 << 20).substr(0, 400);
  EXPECT_THAT(header, HasSubstr("property double x"));
  const PolygonMesh back = read_ply(folder / "theirs.ply");
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(triangulated(back).faces, mesh.faces);
}

/// PCL takes properties of double for zeros, without a word.
TEST(Pcl, WrittenPly_IsReadByPclAndPclsOwnIsReadBack) {
  if (output_of("command -v pcl_ply2pcd && command -v pcl_pcd2ply").empty()) {
    GTEST_SKIP() << "no pcl_ply2pcd (package pcl-tools)";
  }
  const TemporaryDirectory folder;
  write_ply(folder / "a.ply", ball());
  ASSERT_NE(output_of("pcl_ply2pcd '" + (folder / "a.ply").string() + "' '" +
                      (folder / "a.pcd").string() + "'"),
            "");
  // Back, with the elements "camera" and "face" that PCL adds.
  ASSERT_NE(output_of("pcl_pcd2ply '" + (folder / "a.pcd").string() + "' '" +
                      (folder / "b.ply").string() + "'"),
            "");
  const PolygonMesh back = read_ply(folder / "b.ply");
  ASSERT_EQ(back.vertices.rows(), ball().vertices.rows());
  EXPECT_LT((back.vertices - ball().vertices).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Pillow, WrittenImages_AreReadByPillow) {
  if (output_of("/usr/bin/python3 -c 'import PIL'; echo $?") != "0\n") {
    GTEST_SKIP() << "no Pillow (package python3-pil)";
  }
  const TemporaryDirectory folder;
  ByteImage image(2, 2, 3);
  image.data = {255, 0, 0, 0, 255, 0, 0, 0, 255, 10, 20, 30};
  const std::string pixels = "(2, 2) [(255, 0, 0), (0, 255, 0), (0, 0, 255), (10, 20, 30)]\n";
  for (const auto& [name, format] :
       {std::pair("a.png", "PNG"), std::pair("a.tiff", "TIFF"), std::pair("a.bmp", "BMP")}) {
    write_image(folder / name, image);
    EXPECT_EQ(pillow_view(folder / name), std::string(format) + " RGB " + pixels);
  }
  for (const auto& [name, format] : {std::pair("a.jpg", "JPEG"), std::pair("a.webp", "WEBP")}) {
    write_image(folder / name, image);
    EXPECT_THAT(pillow_view(folder / name), HasSubstr(std::string(format) + " RGB (2, 2)"));
  }
  ByteImage labels(2, 2, 1);
  labels.data = {0, 7, 19, 255};
  write_labels(folder / "labels.png", labels);
  EXPECT_EQ(pillow_view(folder / "labels.png"), "PNG P (2, 2) [0, 7, 19, 255]\n");
  image.channels = 1;
  image.data.resize(4);
  write_image(folder / "grey.png", image);
  EXPECT_EQ(pillow_view(folder / "grey.png"), "PNG L (2, 2) [255, 0, 0, 0]\n");
}

}  // namespace
}  // namespace atelier
