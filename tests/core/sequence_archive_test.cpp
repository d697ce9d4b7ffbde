#include "core/sequence_archive.h"

#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A square of two triangles at height y, with every attribute.
Mesh square(double y) {
  Mesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, y, 0, 0, y, 1, 1, y, 1, 1, y, 0;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3;
  mesh.normals = Points::Zero(4, 3);
  mesh.normals.col(1).setOnes();
  mesh.colors = Colors::Constant(4, 3, 0.25f);
  mesh.uvs.resize(4, 2);
  mesh.uvs << 0, 0, 0, 1, 1, 1, 1, 0;
  mesh.uv_faces = mesh.faces;
  mesh.labels = {1, 2, 3, 4};
  mesh.confidence = Eigen::VectorXf::Constant(4, 0.5f);
  return mesh;
}

void expect_equal_sequences(const Mesh& a, const Mesh& b) {
  EXPECT_TRUE(equal_arrays(a.vertices, b.vertices));
  EXPECT_TRUE(equal_arrays(a.faces, b.faces));
  EXPECT_TRUE(equal_arrays(a.normals, b.normals));
  EXPECT_TRUE(equal_arrays(a.colors, b.colors));
  EXPECT_TRUE(equal_arrays(a.uvs, b.uvs));
  EXPECT_TRUE(equal_arrays(a.uv_faces, b.uv_faces));
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_TRUE(equal_arrays(a.confidence, b.confidence));
}

template <class Call>
std::string sequence_archive_refusal(const Call& call) {
  try {
    call();
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(MeshArchive, WrittenMesh_ReadsBackBitExact) {
  const fixtures::TemporaryDirectory folder;
  const Mesh mesh = square(1.0 / 3.0);
  write_mesh_archive(folder / "a.h5", mesh);
  expect_equal_sequences(read_mesh_archive(folder / "a.h5"), mesh);
}

TEST(MeshArchive, EmptyAttributes_StayEmpty) {
  const fixtures::TemporaryDirectory folder;
  Mesh mesh;
  mesh.vertices = square(0).vertices;
  write_mesh_archive(folder / "a.h5", mesh);
  expect_equal_sequences(read_mesh_archive(folder / "a.h5"), mesh);
  EXPECT_EQ(archive_contents(folder / "a.h5").datasets.size(), 1u);
  expect_equal_sequences(mesh_of(archive_of(Mesh{})), Mesh{});
}

TEST(MeshArchive, CoordinateBeyondLimit_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  Mesh mesh = square(0);
  mesh.vertices(1, 1) = -1e300;
  write_archive(folder / "far.h5", archive_of(mesh));
  EXPECT_THAT(sequence_archive_refusal([&] { read_mesh_archive(folder / "far.h5"); }),
              AllOf(HasSubstr("far.h5: vertices"), HasSubstr("coordinate 1e+300"),
                    HasSubstr("at most 1e+09")));
  mesh.vertices(1, 1) = 1e9;
  write_archive(folder / "near.h5", archive_of(mesh));
  expect_equal_sequences(read_mesh_archive(folder / "near.h5"), mesh);
  Limits limits;
  limits.mesh_coordinate = 10;
  EXPECT_THROW(read_mesh_archive(folder / "near.h5", limits), DataError);
}

TEST(MeshArchive, InvalidMesh_IsNotWritten) {
  const fixtures::TemporaryDirectory folder;
  Mesh mesh = square(0);
  mesh.faces(0, 0) = 4;
  EXPECT_THROW(write_mesh_archive(folder / "a.h5", mesh), DataError);
  mesh = square(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(write_mesh_archive(folder / "a.h5", mesh), DataError);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
}

TEST(MeshArchive, SchemaMismatch_IsRefused) {
  const auto refuse = [](const auto& change) {
    Archive archive = archive_of(square(0));
    change(archive);
    return sequence_archive_refusal([&] { mesh_of(archive, "a.h5"); });
  };
  EXPECT_THAT(refuse([](Archive& a) { a.units = "cm"; }), HasSubstr("a.h5: units: cm"));
  EXPECT_THAT(refuse([](Archive& a) { a.up_axis = "z"; }), HasSubstr("up z"));
  EXPECT_THAT(refuse([](Archive& a) { a.datasets["extra"] = tensor_of(std::vector<int>{1}); }),
              HasSubstr("extra: not of this schema"));
  EXPECT_THAT(refuse([](Archive& a) { a.datasets["vertices"] = tensor_of(std::vector<int>{1}); }),
              HasSubstr("vertices: int32 [1]; expected float64 of rank 2"));
  EXPECT_THAT(refuse([](Archive& a) {
                a.datasets["vertices"] = tensor_of(std::vector<double>(8), {4, 2});
              }),
              HasSubstr("expected [rows,3]"));
  EXPECT_THAT(refuse([](Archive& a) {
                a.datasets["faces"] = tensor_of(std::vector<int>{0, 1, 4}, {1, 3});
                a.datasets.erase("uv_faces");
              }),
              HasSubstr("index 4"));
  EXPECT_THAT(
      refuse([](Archive& a) { a.datasets["labels"] = tensor_of(std::vector<std::uint8_t>{1}); }),
      HasSubstr("labels"));
}

TEST(SequenceArchive, WrittenSequence_ReadsBackEqual) {
  const fixtures::TemporaryDirectory folder;
  const Sequence sequence = sequence_of({square(0), square(1), square(2)}, 30, {3, 7, 100});
  write_sequence(folder / "drape", sequence);
  const Sequence again = open_sequence(folder / "drape");
  EXPECT_EQ(again.fps, 30);
  EXPECT_THAT(again.frame_ids, ElementsAre(3, 7, 100));
  EXPECT_TRUE(equal_arrays(again.faces, sequence.faces));
  for (Index i = 0; i < 3; ++i) {
    expect_equal_sequences(frame(again, i), square(static_cast<double>(i)));
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "drape/frames/000100.h5"));
}

TEST(SequenceArchive, SharedTopology_IsStoredOnce) {
  const fixtures::TemporaryDirectory folder;
  write_sequence(folder.path(), sequence_of({square(0), square(1)}, 30));
  EXPECT_TRUE(archive_contents(folder / "sequence.h5").datasets.contains("faces"));
  EXPECT_FALSE(archive_contents(folder / "frames/000000.h5").datasets.contains("faces"));
}

TEST(SequenceArchive, Scans_KeepOwnTopology) {
  const fixtures::TemporaryDirectory folder;
  Mesh other = square(1);
  other.faces.conservativeResize(1, 3);
  other.uv_faces.conservativeResize(1, 3);
  write_sequence(folder.path(), sequence_of({square(0), other}, 30));
  const Sequence again = open_sequence(folder.path());
  EXPECT_EQ(again.faces.rows(), 0);
  expect_equal_sequences(frame(again, 1), other);
}

TEST(SequenceArchive, Frames_CanBeWrittenInAnyOrder) {
  const fixtures::TemporaryDirectory folder;
  SequenceHeader header{60, {1, 2}, {}};
  header.shared.faces = square(0).faces;
  header.shared.uvs = square(0).uvs;
  header.shared.uv_faces = square(0).uv_faces;
  write_sequence_header(folder.path(), header);
  write_sequence_frame(folder.path(), header, 2, square(2));
  const Sequence sequence = open_sequence(folder.path());
  expect_equal_sequences(frame(sequence, 1), square(2));
  EXPECT_THAT(sequence_archive_refusal([&] { frame(sequence, 0); }), HasSubstr("000001.h5"));
}

TEST(SequenceArchive, FrameOfOtherTopology_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  const SequenceHeader header{30, {0}, {{}, square(0).faces, {}, {}, {}, {}, {}, {}}};
  write_sequence_header(folder.path(), header);
  Mesh mesh = square(0);
  mesh.uvs.resize(0, 2);
  mesh.uv_faces.resize(0, 3);
  mesh.faces(0, 1) = 3;
  EXPECT_THROW(write_sequence_frame(folder.path(), header, 0, mesh), DataError);
  EXPECT_THROW(write_sequence_frame(folder.path(), header, 1, mesh), LogicError);
  // A frame file put there by other means: too few vertices for the shared faces.
  Mesh small;
  small.vertices = square(0).vertices.topRows(3);
  std::filesystem::create_directories(folder / "frames");
  write_mesh_archive(folder / "frames/000000.h5", small);
  EXPECT_THAT(sequence_archive_refusal([&] { frame(open_sequence(folder.path()), 0); }),
              HasSubstr("index 3"));
  write_mesh_archive(folder / "frames/000000.h5", square(0));
  EXPECT_THAT(sequence_archive_refusal([&] { frame(open_sequence(folder.path()), 0); }),
              HasSubstr("a topology of its own"));
}

TEST(SequenceArchive, BadHeaderOnWrite_ThrowsLogicError) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(write_sequence_header(folder.path(), {0, {0}, {}}), LogicError);
  EXPECT_THROW(write_sequence_header(folder.path(), {30, {1, 1}, {}}), LogicError);
  EXPECT_THROW(write_sequence_header(folder.path(), {30, {-1}, {}}), LogicError);
  EXPECT_THROW(write_sequence_header(folder.path(), {30, {0}, square(0)}), LogicError);
}

TEST(SequenceArchive, BadHeaderInFile_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  const auto refuse = [&](const auto& change) {
    Archive archive;
    archive.schema = "atelier.sequence";
    archive.numbers["fps"] = 30;
    archive.datasets["frame_ids"] = tensor_of(std::vector<int>{0, 1});
    change(archive);
    write_archive(folder / "sequence.h5", archive);
    return sequence_archive_refusal([&] { open_sequence(folder.path()); });
  };
  EXPECT_EQ(refuse([](Archive&) {}), "");
  EXPECT_THAT(refuse([](Archive& a) { a.numbers.clear(); }), HasSubstr("fps: missing"));
  EXPECT_THAT(refuse([](Archive& a) { a.numbers["fps"] = -1; }), HasSubstr("frames per second"));
  EXPECT_THAT(refuse([](Archive& a) { a.datasets.clear(); }), HasSubstr("frame_ids"));
  EXPECT_THAT(refuse([](Archive& a) {
                a.datasets["frame_ids"] = tensor_of(std::vector<int>{1, 0});
              }),
              HasSubstr("do not increase"));
  EXPECT_THAT(refuse([](Archive& a) {
                a.datasets["vertices"] = tensor_of(std::vector<double>{0, 0, 0}, {1, 3});
              }),
              HasSubstr("vertices"));
  EXPECT_THAT(sequence_archive_refusal([&] { open_sequence(folder / "missing"); }),
              HasSubstr("sequence.h5"));
}

}  // namespace
}  // namespace atelier
