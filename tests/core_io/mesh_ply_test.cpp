#include "core/io/mesh_ply.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_obj.h"
#include "tests/core_io/mesh_cases.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::TemporaryDirectory;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

PolygonMesh parse_ply(const std::string& text, const Limits& limits = {}) {
  return read_ply(std::as_bytes(std::span(text)), "test.ply", limits);
}

std::string mesh_ply_refusal(const std::string& text, const Limits& limits = {}) {
  return fixtures::refusal_of([&] { parse_ply(text, limits); });
}

template <class T>
std::string raw(T value, bool big = false) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return big ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kList = "property list uchar int vertex_indices\n";

std::string ascii(const std::string& header, const std::string& body) {
  return "ply\nformat ascii 1.0\n" + header + "end_header\n" + body;
}

TEST(ReadPly, AsciiSquare_IsRead) {
  const PolygonMesh mesh = parse_ply(
      ascii("comment by hand\nobj_info x\nelement vertex 4\n" + kXyz + "element face 1\n" + kList,
            "0 0 0\n1 0 0\n\n1 1 0\r\n0 1 0.5\n4 0 1 2 3\n"));
  EXPECT_EQ(mesh.vertices(3, 2), 0.5);
  EXPECT_THAT(mesh.corner_vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(mesh.convention.metres_per_unit, 0);
}

TEST(ReadPly, CrLfHeader_IsRead) {
  const std::string text =
      "ply\r\nformat binary_little_endian 1.0\r\nelement vertex 1\r\nproperty float x\r\n"
      "property float y\r\nproperty float z\r\nend_header\r\n" +
      raw(1.0f) + raw(2.0f) + raw(3.0f);
  EXPECT_EQ(parse_ply(text).vertices.row(0), Eigen::RowVector3d(1, 2, 3));
}

TEST(ReadPly, EveryType_IsReadInBothByteOrders) {
  for (const bool big : {false, true}) {
    std::string text = std::string("ply\nformat ") +
                       (big ? "binary_big_endian" : "binary_little_endian") +
                       " 1.0\nelement vertex 1\nproperty char x\nproperty short y\nproperty int z\n"
                       "property double nx\nproperty float32 ny\nproperty int8 nz\n"
                       "property uint8 label\nproperty uint16 red\nproperty uchar green\n"
                       "property float blue\nproperty uint extra\nelement face 1\n"
                       "property list uint uint vertex_index\nend_header\n";
    text += raw<std::int8_t>(-5) + raw<std::int16_t>(-300, big) + raw<std::int32_t>(-70'000, big);
    text += raw(0.6, big) + raw(0.8f, big) + raw<std::int8_t>(0);
    text += raw<std::uint8_t>(200) + raw<std::uint16_t>(65'535, big) + raw<std::uint8_t>(0);
    text += raw(0.5f, big) + raw<std::uint32_t>(4'000'000'000u, big);
    text += raw<std::uint32_t>(3, big);
    for (int i = 0; i < 3; ++i) {
      text += raw<std::uint32_t>(0, big);
    }
    const PolygonMesh mesh = parse_ply(text);
    EXPECT_EQ(mesh.vertices.row(0), Eigen::RowVector3d(-5, -300, -70'000));
    EXPECT_NEAR(mesh.vertex_normals(0, 0), 0.6, 1e-7);
    EXPECT_EQ(mesh.labels[0], 200);
    EXPECT_EQ(mesh.colors(0, 0), 1);
    EXPECT_EQ(mesh.colors(0, 1), 0);
    EXPECT_NEAR(mesh.colors(0, 2), 0.214041, 1e-5);
    EXPECT_EQ(polygon_count(mesh), 1);
  }
}

TEST(ReadPly, UnknownElementsAndProperties_AreSkipped) {
  const PolygonMesh mesh = parse_ply(ascii(
      "element camera 2\nproperty list uchar float stuff\nproperty int id\nelement vertex 3\n" +
          kXyz + "property list char short tags\nelement face 1\nproperty uchar flags\n" + kList +
          "element edge 1\nproperty int a\nproperty int b\n",
      "2 0.5 0.5 7\n0 8\n0 0 0 0\n1 0 0 2 5 6\n0 1 0 1 9\n1 3 0 1 2\n0 1\n"));
  EXPECT_THAT(mesh.corner_vertices, ElementsAre(0, 1, 2));
  EXPECT_EQ(mesh.vertices(2, 1), 1);
}

TEST(ReadPly, FacesBeforeVertices_AreRead) {
  const std::string header = "element face 1\n" + kList + "element vertex 3\n" + kXyz;
  EXPECT_EQ(triangulated(parse_ply(ascii(header, "3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n"))).faces.rows(),
            1);
  EXPECT_THAT(mesh_ply_refusal(ascii(header, "3 0 1 3\n0 0 0\n1 0 0\n0 1 0\n")),
              HasSubstr("face 0: index 3; expected 0 to 2"));
}

TEST(ReadPly, EqualCornerTextureCoordinates_AreShared) {
  const PolygonMesh mesh = parse_ply(
      ascii("element vertex 4\n" + kXyz + "element face 2\n" + kList +
                "property list uchar float texcoord\n",
            "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 0.5 1 0 1\n"));
  EXPECT_EQ(mesh.uvs.rows(), 5);
  EXPECT_THAT(mesh.corner_uvs, ElementsAre(0, 1, 2, 0, 3, 4));
}

TEST(ReadPly, BadConfidence_IsClampedAndZeroNormalsDropped) {
  const PolygonMesh mesh = parse_ply(ascii(
      "element vertex 2\n" + kXyz +
          "property float nx\nproperty float ny\nproperty float nz\nproperty float confidence\n",
      "0 0 0 0 0 1 1.5\n1 0 0 0 0 0 0.25\n"));
  EXPECT_EQ(mesh.confidence[0], 1);
  EXPECT_EQ(mesh.confidence[1], 0.25f);
  EXPECT_EQ(mesh.vertex_normals.rows(), 0);
  ASSERT_EQ(mesh.findings.size(), 2u);
  EXPECT_EQ(mesh.findings[0].code, "ply-confidence");
  EXPECT_EQ(mesh.findings[1].code, "ply-normals");
}

TEST(ReadPly, BrokenHeader_IsRefused) {
  const std::string vertex = "element vertex 1\n" + kXyz;
  const struct {
    std::string text;
    const char* words;
  } cases[] = {
      {"", "no PLY file"},
      {"plyx\n", "line 1: no PLY file"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nend_h", "ends in its header, behind 'end_h'"},
      {"ply\nform", "ends in its header, behind 'form'"},
      {"solid x\n", "no PLY file"},
      {"ply\n", "the file ends in its header"},
      {"ply\nformat ascii 1.0\n", "the file ends in its header"},
      {"ply\nformat ascii 2.0\n", "PLY version '2.0'"},
      {"ply\nformat text 1.0\n", "format 'text'"},
      {"ply\nelement vertex 1\n", "'element'; expected a line \"format"},
      {"ply\nformat ascii 1.0\nformat ascii 1.0\n", "'format'"},
      {"ply\nformat ascii 1.0 x\n", "more words"},
      {"ply\nformat ascii 1.0\nproperty float x\n", "'property'"},
      {ascii("", ""), "no vertex"},
      {ascii("element vertex 0\n" + kXyz, ""), "no vertex"},
      {ascii("element vertex -1\n" + kXyz, ""), "count -1"},
      {ascii("element vertex 1e3\n" + kXyz, ""), "'1e3'"},
      {ascii("element vertex 99999999999999999999\n" + kXyz, ""), "'99999999999999999999'"},
      {ascii("element vertex 1\n", ""), "has rows but no property"},
      {ascii(vertex + vertex, ""), "'vertex' for the second time"},
      {ascii(vertex + "property float x\n", "0 0 0 0\n"), "'x' for the second time"},
      {ascii(vertex + "property uchar red\nproperty uchar r\n", "0 0 0 0 0\n"), "two properties"},
      {ascii(vertex + "property uchar red\n", "0 0 0 0\n"), "some but not all"},
      {ascii(vertex + "property float nx\n", "0 0 0 0\n"), "some but not all"},
      {ascii("element vertex 1\nproperty float x\nproperty float y\n", "0 0\n"),
       "some but not all"},
      {ascii("element vertex 1\nproperty float a\n", "0\n"), "without x, y and z"},
      {ascii("element vertex 1\nproperty half x\n", "0\n"), "type 'half'"},
      {ascii("element vertex 1\nproperty int64 x\n", "0\n"), "type 'int64'"},
      {ascii("element vertex 1\nproperty float\n", "0\n"), "no name"},
      {ascii(vertex + "property list float int tags\n", "0 0 0 0\n"), "floating-point"},
      {ascii(vertex + "property int red\nproperty int green\nproperty int blue\n", "0 0 0 1 1 1\n"),
       "colours of a signed"},
      {ascii(vertex + "element face 1\nproperty int a\n", "0 0 0\n1\n"), "without vertex_indices"},
      {ascii(vertex + "element face 1\nproperty list uchar float vertex_indices\n",
             "0 0 0\n3 0 0 0\n"),
       "no list of integers"},
      {ascii(vertex + "element face 1\nproperty int vertex_indices\n", "0 0 0\n3\n"),
       "no list of integers"},
      {ascii(vertex + "element face 1\n" + kList + "property list uchar int vertex_index\n",
             "0 0 0\n3 0 0 0 3 0 0 0\n"),
       "or one of two"},
      {ascii("element vertex 3\n" + kXyz +
                 "element tristrips 1\nproperty list int int vertex_indices\n",
             "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
       "triangle strips"},
  };
  for (const auto& test : cases) {
    EXPECT_THAT(mesh_ply_refusal(test.text), HasSubstr(test.words)) << test.text;
  }
  std::string many = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 300; ++i) {
    many += "element e" + std::to_string(i) + " 0\n";
  }
  EXPECT_THAT(mesh_ply_refusal(many), HasSubstr("too many elements"));
}

TEST(ReadPly, BrokenAsciiBody_IsRefused) {
  const std::string header = "element vertex 1\n" + kXyz + "element face 1\n" + kList;
  const struct {
    const char* body;
    const char* words;
  } cases[] = {
      {"0 0 0\n", "1 rows of 'face'"},
      {"0 0 0\n\n \n\n", "the file ends"},
      {"0 0\n3 0 0 0\n", "the line ends"},
      {"0 0 0 0\n3 0 0 0\n", "more numbers"},
      {"0 0 nan\n3 0 0 0\n", "'nan'"},
      {"0 0 1e300\n3 0 0 0\n", "a number that a float holds"},
      {"0 0 1e30\n3 0 0 0\n", "vertex 0: coordinate 1.0000000150474662e+30; expected at most"},
      {"0 0 x\n3 0 0 0\n", "'x'"},
      {"0 0 0\n2 0 0\n", "2 corners"},
      {"0 0 0\n300 0 0 0\n", "300; expected 0 to 255"},
      {"0 0 0\n-1\n", "-1; expected 0 to 255"},
      {"0 0 0\n3 0 0 1\n", "face 0: index 1; expected 0 to 0"},
      {"0 0 0\n3 0 0 -1\n", "index -1"},
      {"0 0 0\n3 0 0 1.5\n", "'1.5'"},
      {"0 0 0\n3 0 0 4294967296\n", "4294967296; expected"},
      {"0 0 0\n3 0 0 0\n3 0 0 0\n", "more lines"},
  };
  for (const auto& test : cases) {
    EXPECT_THAT(mesh_ply_refusal(ascii(header, test.body)), HasSubstr(test.words)) << test.body;
  }
  const std::string labels = "element vertex 1\n" + kXyz + "property int label\n";
  EXPECT_THAT(mesh_ply_refusal(ascii(labels, "0 0 0 256\n")), HasSubstr("label 256"));
  EXPECT_THAT(mesh_ply_refusal(ascii(labels, "0 0 0 -1\n")), HasSubstr("label -1"));
  const std::string colors = "element vertex 1\n" + kXyz +
                             "property float red\nproperty float green\nproperty float blue\n";
  EXPECT_THAT(mesh_ply_refusal(ascii(colors, "0 0 0 0 0 1.5\n")), HasSubstr("colour 1.5"));
  const std::string corners = "element vertex 3\n" + kXyz + "element face 1\n" + kList +
                              "property list uchar float texcoord\n";
  EXPECT_THAT(mesh_ply_refusal(ascii(corners, "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 4 0 0 1 1\n")),
              HasSubstr("texcoord of 4 numbers"));
}

TEST(ReadPly, BinaryOfWrongSize_IsRefused) {
  const std::string head = "ply\nformat binary_little_endian 1.0\n";
  const std::string vertex = "element vertex 1\n" + kXyz;
  const std::string body = raw(0.0f) + raw(0.0f) + raw(0.0f);
  EXPECT_THAT(mesh_ply_refusal(head + "element vertex 2000000000\n" + kXyz + "end_header\n" + body),
              HasSubstr("2000000000 rows of 'vertex' in 12 bytes"));
  EXPECT_THAT(mesh_ply_refusal(head + "element vertex 9223372036854775807\n" + kXyz +
                               "end_header\n" + body),
              HasSubstr("rows of 'vertex'"));
  EXPECT_THAT(mesh_ply_refusal(head + vertex + "end_header\n" + body + "x"),
              HasSubstr("1 bytes more"));
  EXPECT_THAT(mesh_ply_refusal(head + vertex + "end_header\n" + body.substr(1)),
              HasSubstr("1 rows of"));
  EXPECT_THAT(
      mesh_ply_refusal(head + vertex + "end_header\n" + raw(0.0f) + raw(0.0f) + raw(std::nanf(""))),
      HasSubstr("vertex 0: z is nan"));
  EXPECT_THAT(
      mesh_ply_refusal(head + vertex + "end_header\n" + raw(INFINITY) + raw(0.0f) + raw(0.0f)),
      HasSubstr("vertex 0: x is inf"));
  const std::string faces = head + vertex +
                            "element face 1\nproperty list int int vertex_indices\n" +
                            "end_header\n" + body;
  EXPECT_THAT(mesh_ply_refusal(faces + raw<std::int32_t>(-3)), HasSubstr("a list of -3 items"));
  EXPECT_THAT(mesh_ply_refusal(faces + raw<std::int32_t>(2'000'000'000)),
              HasSubstr("2000000000 corners"));
  EXPECT_THAT(mesh_ply_refusal(faces + raw<std::int32_t>(3) + raw<std::int32_t>(0)),
              HasSubstr("number"));
  const std::string skipped = head + "element junk 1\nproperty list uint double a\n" + vertex +
                              "end_header\n" + raw<std::uint32_t>(0xFFFFFFFF) + body;
  EXPECT_THAT(mesh_ply_refusal(skipped), HasSubstr("list"));
}

TEST(ReadPly, FileBeyondLimits_NamesTheLimit) {
  const std::string text = ascii("element vertex 4\n" + kXyz + "element face 1\n" + kList,
                                 "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n4 0 1 2 3\n");
  Limits limits;
  limits.mesh_vertices = 3;
  EXPECT_THAT(mesh_ply_refusal(text, limits), HasSubstr("4 vertices; expected at most 3"));
  limits = {};
  limits.mesh_faces = 1;
  EXPECT_THAT(mesh_ply_refusal(text, limits), HasSubstr("more than 1 triangles"));
  limits.mesh_faces = 0;
  EXPECT_THAT(mesh_ply_refusal(text, limits), HasSubstr("1 faces; expected at most 0"));
  limits = {};
  limits.line_bytes = 10;
  EXPECT_THAT(mesh_ply_refusal(text, limits), HasSubstr("a line of"));
}

class WritePly : public ::testing::TestWithParam<PlyFormat> {};

TEST_P(WritePly, ExactMode_RoundTripsBitExact) {
  const Mesh mesh = fixtures::full_mesh();
  const PolygonMesh polygons =
      parse_ply(ply_bytes(polygons_of(mesh), {.format = GetParam(), .exact = true}));
  EXPECT_EQ(polygons.convention.metres_per_unit, 1);
  EXPECT_EQ(polygons.convention.up, 'y');
  EXPECT_TRUE(polygons.findings.empty());
  const Mesh back = triangulated(polygons);
  EXPECT_EQ(back.vertices, mesh.vertices);
  EXPECT_EQ(back.faces, mesh.faces);
  EXPECT_EQ(back.normals, mesh.normals);
  EXPECT_EQ(back.uvs, mesh.uvs);
  EXPECT_EQ(back.uv_faces, mesh.uv_faces);
  EXPECT_EQ(back.labels, mesh.labels);
  EXPECT_EQ(back.confidence, mesh.confidence);
  EXPECT_LT((back.colors - mesh.colors).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_P(WritePly, DefaultMode_RoundTripsAsFloatsAndBytes) {
  const Mesh mesh = fixtures::full_mesh();
  const Mesh back = triangulated(parse_ply(ply_bytes(polygons_of(mesh), {.format = GetParam()})));
  EXPECT_EQ(back.vertices.cast<float>(), mesh.vertices.cast<float>());
  EXPECT_EQ(back.labels, mesh.labels);
  EXPECT_LT((back.normals - mesh.normals).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((back.colors - mesh.colors).cwiseAbs().maxCoeff(), 0.5 / 255 * 2.4);
  // A second trip changes nothing.
  const std::string again = ply_bytes(polygons_of(back), {.format = GetParam()});
  EXPECT_EQ(ply_bytes(polygons_of(triangulated(parse_ply(again))), {.format = GetParam()}), again);
}

TEST_P(WritePly, SeamsPolygonsAndMissingUvs_RoundTrip) {
  PolygonMesh mesh;
  mesh.vertices.resize(5, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 2, 2;
  mesh.polygon_starts = {0, 4, 7, 10};
  mesh.corner_vertices = {0, 1, 2, 3, 0, 1, 4, 1, 2, 4};
  mesh.uvs.resize(5, 2);
  mesh.uvs << 0, 0, 1, 0, 1, 1, 0, 1, 0.5, 0.5;
  mesh.corner_uvs = {0, 1, 2, 3, 4, 1, 2, -1, -1, -1};
  const PolygonMesh back = parse_ply(ply_bytes(mesh, {.format = GetParam()}));
  EXPECT_EQ(back.polygon_starts, mesh.polygon_starts);
  EXPECT_EQ(back.corner_vertices, mesh.corner_vertices);
  EXPECT_EQ(back.convention.metres_per_unit, 0);
  for (std::size_t c = 0; c < mesh.corner_uvs.size(); ++c) {
    ASSERT_EQ(back.corner_uvs[c] < 0, mesh.corner_uvs[c] < 0);
    if (mesh.corner_uvs[c] >= 0) {
      EXPECT_EQ(back.uvs.row(back.corner_uvs[c]), mesh.uvs.row(mesh.corner_uvs[c]));
    }
  }
}

TEST_P(WritePly, ThousandCornerPolygonAndPointsOnly_RoundTrip) {
  PolygonMesh mesh;
  mesh.vertices = Points::Zero(1000, 3);
  for (int i = 0; i < 1000; ++i) {
    mesh.vertices.row(i) << std::cos(0.00628 * i), std::sin(0.00628 * i), 0;
    mesh.corner_vertices.push_back(i);
  }
  mesh.polygon_starts = {0, 1000};
  EXPECT_EQ(parse_ply(ply_bytes(mesh, {.format = GetParam()})).corner_vertices,
            mesh.corner_vertices);
  mesh.corner_vertices.clear();
  mesh.polygon_starts = {0};
  EXPECT_EQ(parse_ply(ply_bytes(mesh, {.format = GetParam()})).vertices.rows(), 1000);
}

INSTANTIATE_TEST_SUITE_P(Formats, WritePly,
                         ::testing::Values(PlyFormat::Ascii, PlyFormat::BinaryLittleEndian,
                                           PlyFormat::BinaryBigEndian),
                         [](const auto& instance) {
                           return std::to_string(static_cast<int>(instance.param));
                         });

TEST(WritePlyFile, InvalidMeshOrMissingFolder_IsRefused) {
  const TemporaryDirectory folder;
  Mesh mesh = fixtures::tetrahedron();
  write_ply(folder / "a.ply", mesh);
  EXPECT_EQ(read_ply(folder / "a.ply").vertices.rows(), 4);
  EXPECT_THROW(write_ply(folder / "absent" / "a.ply", mesh), EnvironmentError);
  mesh.faces(0, 0) = 4;
  EXPECT_THROW(write_ply(folder / "a.ply", mesh), LogicError);
  EXPECT_EQ(triangulated(read_ply(folder / "a.ply")).faces.rows(), 4);
}

TEST(WritePlyFile, CoordinateBeyondFloat_IsRefused) {
  const TemporaryDirectory folder;
  Mesh mesh = fixtures::tetrahedron();
  mesh.vertices(1, 2) = -1e300;
  for (const char* name : {"a.ply", "a.glb"}) {
    try {
      write_mesh(folder / name, mesh);
      ADD_FAILURE() << name << " was written";
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), HasSubstr("-1e+300; expected a number that a float holds"));
    }
    EXPECT_FALSE(std::filesystem::exists(folder / name));
  }
  write_ply(folder / "exact.ply", mesh, {.exact = true});
  Limits wide;
  wide.mesh_coordinate = 1e308;
  EXPECT_EQ(read_ply(folder / "exact.ply", wide).vertices(1, 2), -1e300);
  EXPECT_THROW(read_ply(folder / "exact.ply"), DataError);
}

TEST(ReadPly, TextureCoordinateBeyondLimit_IsRefused) {
  const std::string corners = "element vertex 3\n" + kXyz + "element face 1\n" + kList +
                              "property list uchar double texcoord\n";
  EXPECT_THAT(mesh_ply_refusal(ascii(corners, "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 1 0 1e300\n")),
              HasSubstr("face 0: coordinate 1e+300"));
}

TEST(MeshFile, FileExtension_SelectsTheFormat) {
  const TemporaryDirectory folder;
  const Mesh mesh = fixtures::sphere(1);
  for (const char* name : {"a.obj", "a.ply", "B.PLY"}) {
    write_mesh(folder / name, mesh);
    const Mesh back = read_mesh(folder / name, {.metres_per_unit = 0.01, .up = 'z'});
    EXPECT_EQ(back.faces, mesh.faces) << name;
    EXPECT_LT((back.vertices - mesh.vertices).cwiseAbs().maxCoeff(), 1e-7) << name;
  }
  EXPECT_THROW(write_mesh(folder / "a.stl", mesh), LogicError);
  EXPECT_THROW(read_mesh(folder / "a.stl"), DataError);
  EXPECT_THROW(read_mesh(folder / "absent.ply"), DataError);
}

TEST(MeshFile, StatedUnitAndUpAxis_AreConverted) {
  const TemporaryDirectory folder;
  PolygonMesh polygons = polygons_of(fixtures::tetrahedron());
  polygons.convention = {.metres_per_unit = 0.001, .up = 'z'};
  write_ply(folder / "a.ply", polygons);
  const Mesh mesh = read_mesh(folder / "a.ply");
  EXPECT_TRUE(mesh.vertices.row(1).isApprox(Eigen::RowVector3d(0.001, -0.001, 0.001)));
}

}  // namespace
}  // namespace atelier
