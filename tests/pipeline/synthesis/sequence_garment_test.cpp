// Panels and seams of garments that other programs made.
#include "pipeline/synthesis/sequence_garment.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/npz.h"
#include "core/topology.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

constexpr int kColumns = 12;
constexpr int kRows = 5;
constexpr double kCell = 0.05;  // m

/// A sheet of kColumns x kRows cells, rolled to a tube whose first and last column coincide; in the
/// second frame it has moved.
MeshSequenceFile tube(double uv_scale = 1, bool mirrored = false) {
  MeshSequenceFile file;
  Points vertices((kColumns + 1) * (kRows + 1), 3);
  file.shared.uvs.resize(vertices.rows(), 2);
  const double radius = kColumns * kCell / (2 * std::numbers::pi);
  for (int i = 0; i <= kColumns; ++i) {
    for (int j = 0; j <= kRows; ++j) {
      const Index v = i * (kRows + 1) + j;
      const double angle = i == kColumns ? 0 : 2 * std::numbers::pi * i / kColumns;
      vertices.row(v) << radius * std::sin(angle), 1 + kCell * j, radius * std::cos(angle);
      file.shared.uvs.row(v) << (mirrored ? -1 : 1) * uv_scale * kCell * i, uv_scale * kCell * j;
    }
  }
  file.shared.faces.resize(2 * kColumns * kRows, 3);
  for (int i = 0; i < kColumns; ++i) {
    for (int j = 0; j < kRows; ++j) {
      const int v = i * (kRows + 1) + j;
      const Index f = 2 * (i * kRows + j);
      file.shared.faces.row(f) << v, v + kRows + 1, v + kRows + 2;
      file.shared.faces.row(f + 1) << v, v + kRows + 2, v + 1;
    }
  }
  file.shared.uv_faces = file.shared.faces;
  file.sequence.frame_ids = {0, 1};
  file.sequence.faces = file.shared.faces;
  file.sequence.load = [mesh = file.shared, vertices](Index i) {
    Mesh moved = mesh;
    moved.vertices = vertices.rowwise() + Eigen::RowVector3d(0.1 * static_cast<double>(i), 0, 0);
    return moved;
  };
  return file;
}

double seam_metres(const GroundTruthGarment& garment) {
  double length = 0;
  for (const Seam& seam : garment.seams) {
    EXPECT_EQ(seam.a.size(), seam.b.size());
    for (std::size_t i = 1; i < seam.a.size(); ++i) {
      length +=
          (garment.garment.rest.row(seam.a[i]) - garment.garment.rest.row(seam.a[i - 1])).norm();
    }
  }
  return length;
}

double flat_area(const Garment& garment) {
  double area = 0;
  for (Index f = 0; f < garment.rest_faces.rows(); ++f) {
    const auto corner = [&](int k) -> Eigen::RowVector2d {
      return garment.rest.row(garment.rest_faces(f, k));
    };
    const Eigen::RowVector2d a = corner(1) - corner(0);
    const Eigen::RowVector2d b = corner(2) - corner(0);
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

TEST(SequenceGarment, CoincidentEdges_AreASeam) {
  for (const double scale : {1.0, 0.4, 17.0}) {
    const SequenceGarment made = sequence_garment(tube(scale));
    const Garment& garment = made.truth.garment;
    EXPECT_EQ(garment.mesh.vertices.rows(), kColumns * (kRows + 1)) << scale;
    EXPECT_EQ(made.rows.size(), static_cast<std::size_t>(garment.mesh.vertices.rows()));
    EXPECT_EQ(boundary_loops(topology_of(garment.mesh.faces, garment.mesh.vertices.rows())).size(),
              2U);
    EXPECT_EQ(garment.panel_names.size(), 1U);
    ASSERT_EQ(made.truth.seams.size(), 1U);
    // The tube's chords are shorter than the sheet's cells, by 1%.
    EXPECT_NEAR(seam_metres(made.truth), kRows * kCell, 0.02 * kRows * kCell);
    EXPECT_NEAR(flat_area(garment), kColumns * kRows * kCell * kCell,
                0.03 * kColumns * kRows * kCell * kCell);
    EXPECT_NO_THROW(check_garment(garment));
    EXPECT_GE(garment.mesh.uvs.minCoeff(), 0);
    EXPECT_LE(garment.mesh.uvs.maxCoeff(), 1);
  }
}

TEST(SequenceGarment, MirroredPanels_AreTurnedOver) {
  EXPECT_GT(flat_area(sequence_garment(tube(1, true)).truth.garment), 0);
  EXPECT_NEAR(seam_metres(sequence_garment(tube(1, true)).truth), kRows * kCell, 1e-9);
}

TEST(SequenceGarment, SharedVerticesWithTwoTexturePlaces_AreASeam) {
  // As an OBJ has it: the surface is closed, the texture is not.
  MeshSequenceFile file = tube();
  const SequenceGarment apart = sequence_garment(file);
  const Mesh joined = apart.truth.garment.mesh;
  MeshSequenceFile welded;
  welded.shared = joined;
  welded.sequence.frame_ids = {0};
  welded.sequence.faces = joined.faces;
  welded.sequence.load = [joined](Index) { return joined; };
  const SequenceGarment made = sequence_garment(welded);
  EXPECT_EQ(made.truth.garment.mesh.vertices.rows(), joined.vertices.rows());
  EXPECT_NEAR(seam_metres(made.truth), kRows * kCell, 1e-9);
}

TEST(SequenceGarment, TextureThatIsNoPattern_TellsNoSeams) {
  MeshSequenceFile file = tube();
  for (Index v = 0; v < file.shared.uvs.rows(); ++v) {  // squeezed more and more
    file.shared.uvs(v, 0) = std::pow(file.shared.uvs(v, 0), 3);
  }
  const SequenceGarment made = sequence_garment(file);
  EXPECT_TRUE(made.truth.seams.empty());
  EXPECT_EQ(made.truth.garment.rest.rows(), 0);
  EXPECT_EQ(made.truth.garment.mesh.vertices.rows(), (kColumns + 1) * (kRows + 1));
  file = tube();
  file.shared.uvs.resize(0, 2);
  file.shared.uv_faces.resize(0, 3);
  EXPECT_TRUE(sequence_garment(file).truth.seams.empty());
}

TEST(SequenceGarment, EdgesThatMeetInOneFrameAlone_AreNoSeam) {
  MeshSequenceFile file = tube();
  file.sequence.load = [first = file.sequence.load](Index i) {
    Mesh mesh = first(i);
    if (i == 1) {
      mesh.vertices.bottomRows(kRows + 1).col(2).array() += 0.02;
    }
    return mesh;
  };
  EXPECT_TRUE(sequence_garment(file).truth.seams.empty());
}

TEST(MeshSequenceOfTwo, BodyAndClothInOneFile_AreReadApart) {
  const fixtures::TemporaryDirectory folder;
  const std::string npz = (folder / "both.npz").string();
  const auto vertices = [](float height) {
    return tensor_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, height, 0.2F}, {1, 3, 3});
  };
  const Tensor faces = tensor_of(std::vector<int>{0, 1, 2}, {1, 3});
  write_npz(npz, {{"body_vertices", vertices(1.7F)},
                  {"body_faces", faces},
                  {"body_labels", tensor_of(std::vector<int>{0, 0, 0}, {3})},
                  {"joints", tensor_of(std::vector<float>{0, 1, 0, 0, 1.5F, 0}, {1, 2, 3})},
                  {"cloth_vertices", vertices(0.5F)},
                  {"cloth_faces", faces},
                  {"cloth_uv", tensor_of(std::vector<float>{0, 0, 1, 0, 0, 1}, {3, 2})}});
  const MeshSequenceFile body = read_mesh_sequence(npz, SequenceOf::Person);
  EXPECT_NEAR(frame(body.sequence, 0).vertices.col(1).maxCoeff(), 1.7, 1e-6);
  EXPECT_TRUE(body.shared.labels.empty());
  EXPECT_EQ(body.names, (std::vector<std::string>{"joint_0", "joint_1"}));
  const MeshSequenceFile cloth = read_mesh_sequence(npz, SequenceOf::Cloth);
  EXPECT_NEAR(frame(cloth.sequence, 0).vertices.col(1).maxCoeff(), 0.5, 1e-6);
  EXPECT_EQ(cloth.shared.uvs.rows(), 3);
  write_npz(npz, {{"body_vertices", vertices(1.7F)}, {"body_faces", faces}});
  EXPECT_THROW(read_mesh_sequence(npz, SequenceOf::Cloth), DataError);
}

TEST(SequenceGarment, ForeignSimulatorsSkirt_IsOnePanelWithASeam) {
  ATELIER_TEST_FILE(path, "other_simulator/sequence.npz");
  const MeshSequenceFile file = read_mesh_sequence(path, SequenceOf::Cloth);
  const SequenceGarment made = sequence_garment(file);
  EXPECT_EQ(made.truth.garment.panel_names.size(), 1U);
  EXPECT_EQ(made.rows.size(), 3781U - 36U);
  EXPECT_EQ(made.truth.seams.size(), 1U);
  EXPECT_NEAR(seam_metres(made.truth), 0.58, 0.001);
  EXPECT_GT(flat_area(made.truth.garment), 0);
}

}  // namespace
}  // namespace atelier
