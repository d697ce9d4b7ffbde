#include "core/io/mesh_obj.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <clocale>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/mesh_file.h"
#include "tests/core_io/mesh_cases.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::TemporaryDirectory;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

PolygonMesh parse_obj(const std::string& text, const Limits& limits = {}) {
  return read_obj(std::as_bytes(std::span(text)), "test.obj", limits);
}

std::string mesh_obj_refusal(const std::string& text, const Limits& limits = {}) {
  return fixtures::refusal_of([&] { parse_obj(text, limits); });
}

const std::string kMeshObjSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ReadObj, Quad_BecomesTwoTriangles) {
  const PolygonMesh polygons = parse_obj(kMeshObjSquare + "f 1 2 3 4\n");
  EXPECT_EQ(polygon_count(polygons), 1);
  const Mesh mesh = triangulated(polygons);
  ASSERT_EQ(mesh.faces.rows(), 2);
  EXPECT_EQ(mesh.faces.row(0), Eigen::RowVector3i(0, 1, 2));
  EXPECT_EQ(mesh.faces.row(1), Eigen::RowVector3i(0, 2, 3));
}

TEST(ReadObj, EveryCornerForm_IsRead) {
  const PolygonMesh mesh =
      parse_obj(kMeshObjSquare +
                "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
                "f 1 2 3\nf 1/1 2/2 3/3\nf 1//1 2//1 3//1\nf 1/1/1 2/2/1 3/3/1\n");
  EXPECT_EQ(polygon_count(mesh), 4);
  EXPECT_THAT(mesh.corner_uvs, ElementsAre(-1, -1, -1, 0, 1, 2, -1, -1, -1, 0, 1, 2));
  EXPECT_THAT(mesh.corner_normals, ElementsAre(-1, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0));
}

TEST(ReadObj, NegativeIndices_CountBackwards) {
  const PolygonMesh mesh = parse_obj(kMeshObjSquare + "f -4 -3 -2\nv 5 5 5\nf -1 -2 -3\n");
  EXPECT_THAT(mesh.corner_vertices, ElementsAre(0, 1, 2, 4, 3, 2));
}

TEST(ReadObj, ForwardReferences_AreRead) {
  EXPECT_THAT(parse_obj("f 1 2 3\n" + kMeshObjSquare).corner_vertices, ElementsAre(0, 1, 2));
}

TEST(ReadObj, LineEndsTabsAndContinuations_AreRead) {
  const PolygonMesh mesh = parse_obj(
      "\xEF\xBB\xBFv 0 0 0\r\nv\t1\t0\t0\r\n  v 1 1 0  \r\n\r\nf 1 \\\r\n 2 \\\n 3 # a comment");
  EXPECT_THAT(mesh.corner_vertices, ElementsAre(0, 1, 2));
  EXPECT_EQ(mesh.vertices(1, 0), 1);
}

TEST(ReadObj, CommentEndingInBackslash_IsNotContinued) {
  EXPECT_EQ(parse_obj("# C:\\models\\\n" + kMeshObjSquare + "f 1 2 3\n").vertices.rows(), 4);
}

TEST(ReadObj, EveryNumberForm_IsRead) {
  const PolygonMesh mesh = parse_obj("v +1 -.5 1e-3\nv 1. 1E2 -0\nv 1e-400 4.9e-324 -1e9\n");
  EXPECT_EQ(mesh.vertices(0, 0), 1);
  EXPECT_EQ(mesh.vertices(0, 1), -0.5);
  EXPECT_EQ(mesh.vertices(0, 2), 1e-3);
  EXPECT_EQ(mesh.vertices(1, 1), 100);
  EXPECT_TRUE(std::signbit(mesh.vertices(1, 2)));
  EXPECT_EQ(mesh.vertices(2, 0), 0);
  EXPECT_EQ(mesh.vertices(2, 1), 4.9e-324);
  EXPECT_EQ(mesh.vertices(2, 2), -1e9);
}

TEST(ReadObj, Numbers_AreIndependentOfLocale) {
  const char* before = std::setlocale(LC_ALL, nullptr);
  const std::string kept = before;
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"}) {
    std::setlocale(LC_ALL, name);  // stays as it is where the locale is not installed
    EXPECT_EQ(parse_obj("v 0.5 1.25 2\n").vertices(0, 1), 1.25);
  }
  std::setlocale(LC_ALL, kept.c_str());
}

TEST(ReadObj, VertexColors_AreLinearized) {
  const PolygonMesh mesh = parse_obj("v 0 0 0 0 0.5 1\nv 1 0 0 1 1 1\nv 1 1 0 0 0 0\nf 1 2 3\n");
  ASSERT_EQ(mesh.colors.rows(), 3);
  EXPECT_NEAR(mesh.colors(0, 1), 0.214041, 1e-5);
  EXPECT_EQ(mesh.colors(1, 0), 1);
}

TEST(ReadObj, GroupsObjectsAndMaterials_AreKept) {
  const PolygonMesh mesh = parse_obj(
      "mtllib a b.mtl\n" + kMeshObjSquare +
      "f 1 2 3\no Body One\ng left arm\nusemtl skin\nf 1 2 4\ng right\nf 2 3 4\ng left arm\n"
      "f 1 3 4\n");
  EXPECT_THAT(mesh.group_names, ElementsAre("left arm", "right"));
  EXPECT_THAT(mesh.polygon_groups, ElementsAre(-1, 0, 1, 0));
  EXPECT_THAT(mesh.object_names, ElementsAre("Body One"));
  EXPECT_THAT(mesh.polygon_materials, ElementsAre(-1, 0, 0, 0));
  EXPECT_THAT(mesh.material_files, ElementsAre("a b.mtl"));
}

TEST(ReadObj, PointsWithoutFaces_AreAMesh) {
  const Mesh mesh = triangulated(parse_obj("v 0 0 0\nvn 0 0 2\nv 1 2 3\nvn 0 3 0\n"));
  EXPECT_EQ(mesh.faces.rows(), 0);
  ASSERT_EQ(mesh.normals.rows(), 2);
  EXPECT_EQ(mesh.normals.row(1), Eigen::RowVector3d(0, 1, 0));
}

TEST(ReadObj, Normals_AreKeptOnlyIfUniquePerVertex) {
  const std::string normals = "vn 0 0 1\nvn 0 0 2\nvn 1 0 0\n";
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  EXPECT_EQ(triangulated(parse_obj(triangle + normals + "f 1//2 2//1 3//3\n")).normals.rows(), 3);
  EXPECT_EQ(triangulated(parse_obj(triangle + normals + "f 1//1 2//1 3//1\nf 1//3 2//1 3//1\n"))
                .normals.rows(),
            0);
  EXPECT_EQ(triangulated(parse_obj(triangle + "vn 0 0 0\nf 1//1 2//1 3//1\n")).normals.rows(), 0);
}

TEST(ReadObj, MangledComments_AreSkippedWithAFinding) {
  // As in the files of a published cloth simulator.
  const PolygonMesh mesh = parse_obj("File Generated by Meshlab\n: 4\n" + kMeshObjSquare +
                                     "f 1 2 3\n5563 vertices, 0 vertices normals\n");
  ASSERT_EQ(mesh.findings.size(), 1u);
  EXPECT_EQ(mesh.findings[0].severity, Severity::Note);
  EXPECT_THAT(mesh.findings[0].what, HasSubstr("3 lines with an unknown word are skipped: 'File'"));
  EXPECT_THAT(mesh.findings[0].place, HasSubstr("line 1"));
}

TEST(ReadObj, WordsOfOtherPrograms_AreSkippedWithAWarning) {
  // As cloth simulators write velocities and labels.
  const PolygonMesh mesh = parse_obj(
      "v 0 0 0\nvv 0 0 0\nv 1 0 0\nvv 0 0 0\nv 1 1 0\nvv 0 0 0\nf 1 2 3\nt 0\nnl 4\nms 0 1\n");
  EXPECT_EQ(mesh.vertices.rows(), 3);
  EXPECT_EQ(polygon_count(mesh), 1);
  ASSERT_EQ(mesh.findings.size(), 1u);
  EXPECT_EQ(mesh.findings[0].severity, Severity::Warning);
  EXPECT_THAT(mesh.findings[0].what, "6 lines with an unknown word are skipped: 'vv', 't', 'nl'");
  EXPECT_THAT(mesh.findings[0].place, HasSubstr("line 2"));
}

TEST(ReadObj, GarmentsOfThePublicLibrary_AreRead) {
  ATELIER_TEST_FILE(file, "berkeley_garments/dress3/dress3-iso-draped.obj");
  const MeshFile read = read_mesh_file(file);
  EXPECT_EQ(read.mesh.vertices.rows(), 3208);
  EXPECT_EQ(read.mesh.faces.rows(), 6244);
  EXPECT_EQ(read.mesh.uvs.rows(), 18732);
}

TEST(ReadObj, UnitsAndUpAxis_ComeFromComments) {
  const PolygonMesh said = parse_obj("# Units: Centimeters\n# up: z\n" + kMeshObjSquare);
  EXPECT_EQ(said.convention.metres_per_unit, 0.01);
  EXPECT_EQ(said.convention.up, 'z');
  const PolygonMesh silent = parse_obj("# units: furlongs\n# up: north\n" + kMeshObjSquare);
  EXPECT_EQ(silent.convention.metres_per_unit, 0);
  EXPECT_EQ(silent.convention.up, '\0');
}

TEST(ReadObj, MalformedLines_AreRefused) {
  const struct {
    const char* text;
    const char* words;
  } cases[] = {
      {"", "no vertex"},
      {"# nothing\n", "no vertex"},
      {"v 1 2\n", "line 1: 2 numbers"},
      {"v 1 2 3 4 5\n", "5 numbers"},
      {"v 1 2 3 4 5 6 7 8\n", "'8'"},
      {"v 1 2 x\n", "'x'"},
      {"v 1 2 nan\n", "'nan'"},
      {"v 1 2 inf\n", "'inf'"},
      {"v 1 2 -infinity\n", "'-infinity'"},
      {"v 1 2 1e999\n", "'1e999'"},
      {"v 1 2 1e300\n", "line 1: coordinate 1e+300; expected at most 1e+09"},
      {"v 0 0 0\nv -1.1e9 0 0\n", "line 2: coordinate -1.1e+09"},
      {"v 0 0 0\nvt 0 1e300\n", "line 2: coordinate 1e+300"},
      {"v 1 2 0x10\n", "'0x10'"},
      {"v 1 2 1,5\n", "'1,5'"},
      {"v 1 2 --1\n", "'--1'"},
      {"v 1 2 +-1\n", "'+-1'"},
      {"v 0 0 0\nv 1 0 0 1 1 1\n", "line 2: a vertex with a colour"},
      {"v 0 0 0 1 1 1\nv 1 0 0\n", "line 2: a vertex without a colour"},
      {"v 0 0 0 0 0 255\n", "colour 255"},
      {"v 0 0 0 0 -0.1 0\n", "colour -0.1"},
      {"v 0 0 0\nf 1 1 2\n", "line 2: vertex index 2; expected 1 to 1"},
      {"v 0 0 0\nf 1 1 0\n", "'0'; expected vertex index"},
      {"v 0 0 0\nf 1 1 -2\n", "vertex index -2; expected at least -1"},
      {"v 0 0 0\nf 1 1 1.5\n", "'1.5'"},
      {"v 0 0 0\nf 1 1 99999999999999999999\n", "'99999999999999999999'"},
      {"v 0 0 0\nf 1 1 4294967297\n", "vertex index 4294967297"},
      {"v 0 0 0\nf 1 1 -9223372036854775808\n", "vertex index -9223372036854775808"},
      {"v 0 0 0\nf 1/1 1/1 1/1\n", "line 2: uv index 1; expected 1 to 0"},
      {"v 0 0 0\nf 1//1 1//1 1//1\n", "line 2: normal index 1"},
      {"v 0 0 0\nf 1/1/1/1 1 1\n", "vertex/uv/normal"},
      {"v 0 0 0\nf /1 1 1\n", "''; expected vertex"},
      {"v 0 0 0\nf 1 1\n", "a face of 2 corners"},
      {"v 0 0 0\nf\n", "a face of 0 corners"},
      {"v 0 0 0\nvt\n", "the line ends"},
      {"v 0 0 0\nvt 0 y\n", "'y'"},
      {"v 0 0 0\nvn 0 0\n", "the line ends"},
      {"v 0 0 0\ncstype bezier\n", "free-form geometry"},
      {"v 0 0 0\nw 1 0 0\nf 1 1 2\n",
       "line 3: vertex index 2; expected 1 to 1; from line 2 on 1 line with an unknown word is "
       "skipped: 'w'"},
  };
  for (const auto& test : cases) {
    EXPECT_THAT(mesh_obj_refusal(test.text), HasSubstr(test.words)) << test.text;
  }
  EXPECT_THAT(mesh_obj_refusal(std::string("v 0 0 0\nv 0 \0 0 0\n", 18)),
              HasSubstr("line 2: a NUL byte"));
}

TEST(ReadObj, FileBeyondLimits_NamesTheLimit) {
  Limits limits;
  limits.mesh_vertices = 3;
  EXPECT_THAT(mesh_obj_refusal(kMeshObjSquare, limits), HasSubstr("more than 3 vertices"));
  EXPECT_THAT(mesh_obj_refusal("v 0 0 0\nvt 0 0\nvt 0 0\nvt 0 0\nvt 0 0\n", limits),
              HasSubstr("more than 3 texture coordinates"));
  EXPECT_THAT(mesh_obj_refusal("v 0 0 0\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\n", limits),
              HasSubstr("more than 3 normals"));
  limits = {};
  limits.mesh_faces = 1;
  EXPECT_THAT(mesh_obj_refusal(kMeshObjSquare + "f 1 2 3 4\n", limits),
              HasSubstr("more than 1 triangles"));
  limits = {};
  limits.line_bytes = 20;
  EXPECT_THAT(mesh_obj_refusal(kMeshObjSquare + "# 12345678901234567890\n", limits),
              HasSubstr("line 5: a line of 22 bytes"));
  EXPECT_THAT(mesh_obj_refusal(kMeshObjSquare + "f 1 2 3 \\\n 4 1 2 3 4 1 2 3\n", limits),
              HasSubstr("a line of"));
  std::string many = kMeshObjSquare + "f";
  for (int i = 0; i < 1025; ++i) {
    many += " 1";
  }
  EXPECT_THAT(mesh_obj_refusal(many), HasSubstr("more than 1024 corners"));
}

TEST(ReadObj, CoordinateLimit_CanBeSet) {
  Limits limits;
  limits.mesh_coordinate = 2;
  EXPECT_EQ(mesh_obj_refusal("v 2 -2 0\n", limits), "was read");
  EXPECT_THAT(mesh_obj_refusal("v 2.5 0 0\n", limits),
              HasSubstr("coordinate 2.5; expected at most 2"));
  limits.mesh_coordinate = 1e308;
  EXPECT_EQ(mesh_obj_refusal("v 1e300 0 0\n", limits), "was read");
}

TEST(ReadObj, OversizedOrMissingFile_IsNotRead) {
  const TemporaryDirectory folder;
  write_obj(folder / "sphere.obj", fixtures::sphere(2));
  Limits limits;
  limits.mesh_file_bytes = 100;
  EXPECT_THROW(read_obj(folder / "sphere.obj", limits), DataError);
  EXPECT_THROW(read_obj(folder / "absent.obj"), DataError);
}

/// With a seam.
Mesh full_mesh() {
  Mesh mesh = fixtures::full_mesh();
  const Index n = mesh.uvs.rows();
  mesh.uvs.conservativeResize(n + 1, 2);
  mesh.uvs.row(n) << 0.1, 0.7;
  mesh.uv_faces(3, 1) = static_cast<int>(n);
  return mesh;
}

TEST(WriteObj, WrittenMesh_ReadsBackBitExact) {
  const TemporaryDirectory folder;
  const Mesh mesh = full_mesh();
  write_obj(folder / "mesh.obj", mesh);
  const PolygonMesh polygons = read_obj(folder / "mesh.obj");
  EXPECT_EQ(polygons.convention.metres_per_unit, 1);
  EXPECT_EQ(polygons.convention.up, 'y');
  const Mesh back = triangulated(polygons);
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.faces, mesh.faces);
  EXPECT_EQ(back.normals, mesh.normals);
  EXPECT_EQ(back.uvs, mesh.uvs);
  EXPECT_EQ(back.uv_faces, mesh.uv_faces);
  EXPECT_LT((back.colors - mesh.colors).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_TRUE(polygons.findings.empty());
}

TEST(WriteObj, PolygonsNamesAndCorners_RoundTrip) {
  const std::string text = "# units: cm\n# up: z\nmtllib m.mtl\n" + kMeshObjSquare +
                           "vt 0 0\nvt 1 0.25\nvn 0 0 1\nvn 1 0 0\no a\ng one\nusemtl red\n"
                           "f 1/1/1 2/2/2 3/1/1 4/1/1\ng two\nf 1 2 3\n";
  const PolygonMesh mesh = parse_obj(text);
  EXPECT_EQ(obj_text(mesh), text);
}

TEST(WriteObj, BadNamesOrIndices_AreRefused) {
  PolygonMesh mesh = parse_obj(kMeshObjSquare + "g a\nf 1 2 3 4\n");
  mesh.group_names[0] = "a\nv 1 2 3";
  EXPECT_THROW(obj_text(mesh), LogicError);
  mesh.group_names[0] = "a\\";
  EXPECT_THROW(obj_text(mesh), LogicError);
  mesh.group_names[0] = "a";
  mesh.corner_vertices[0] = 4;
  EXPECT_THROW(obj_text(mesh), LogicError);
  mesh.corner_vertices[0] = -1;
  EXPECT_THROW(obj_text(mesh), LogicError);
}

TEST(RealObj, MakeHumanBaseMesh_IsRead) {
  ATELIER_TEST_FILE(path, "makehuman/base/base.obj");
  const PolygonMesh mesh = read_obj(path);
  EXPECT_EQ(mesh.vertices.rows(), 19158);
  EXPECT_EQ(mesh.uvs.rows(), 21334);
  EXPECT_EQ(polygon_count(mesh), 18486);
  EXPECT_EQ(mesh.corner_vertices.size(), 4u * 18486u);
  EXPECT_EQ(mesh.group_names.size(), 139u);
  const auto body = std::find(mesh.group_names.begin(), mesh.group_names.end(), "body");
  ASSERT_NE(body, mesh.group_names.end());
  EXPECT_EQ(std::count(mesh.polygon_groups.begin(), mesh.polygon_groups.end(),
                       static_cast<int>(body - mesh.group_names.begin())),
            13378);
  EXPECT_EQ(triangulated(mesh).faces.rows(), 2 * 18486);
  EXPECT_TRUE(mesh.findings.empty());
  // A body of about 1.7 m in decimetres; its file does not say so.
  EXPECT_EQ(mesh.convention.metres_per_unit, 0);
  const Mesh body_mesh = read_mesh(path, {.metres_per_unit = 0.1, .up = 'y'});
  const double height = body_mesh.vertices.col(1).maxCoeff() - body_mesh.vertices.col(1).minCoeff();
  EXPECT_GT(height, 1.5);
  EXPECT_LT(height, 2.0);
}

TEST(RealObj, DiffClothGarments_AreReadAndWritten) {
  const struct {
    const char* file;
    Index vertices;
    Index faces;
    Index uvs;
  } files[] = {{"dress-handsup-drape.obj", 3634, 7026, 0},
               {"dress-v5k-f10k.obj", 5563, 10180, 0},
               {"dress-v7k-f14k.obj", 7742, 14524, 0},
               {"skirt3448.obj", 1809, 3448, 1},
               {"sock482.obj", 482, 944, 2410},
               {"tshirt1900-flattened.obj", 1921, 3726, 0},
               {"tshirt1900.obj", 1921, 3726, 8177}};
  for (const auto& file : files) {
    ATELIER_TEST_FILE(path, std::string("garments/diffcloth/") + file.file);
    const Mesh mesh = triangulated(read_obj(path));
    EXPECT_EQ(mesh.vertices.rows(), file.vertices) << file.file;
    EXPECT_EQ(mesh.faces.rows(), file.faces) << file.file;
    EXPECT_EQ(mesh.uvs.rows(), file.uvs) << file.file;
    check_mesh(mesh, file.file);
    // What is written is the same mesh.
    const std::string text = obj_text(polygons_of(mesh));
    EXPECT_EQ(triangulated(parse_obj(text)).vertices, mesh.vertices) << file.file;
  }
}

}  // namespace
}  // namespace atelier
