// Garments of the test data, laid flat along the seams that open them.

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "registration/drafting/draft_pattern.h"
#include "registration/edge_paths.h"
#include "registration/flattening/cut_to_disks.h"
#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/part_overlaps.h"
#include "registration/flattening/pattern_pieces.h"
#include "registration/orient_faces.h"
#include "tests/support/shapes.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

class RealMeshes : public ::testing::TestWithParam<const char*> {};

TEST_P(RealMeshes, RealMesh_LiesFlatWithoutInversionsOrOverlaps) {
  ATELIER_TEST_FILE(file, GetParam());
  Mesh mesh = read_mesh(file, {.metres_per_unit = 0.1, .up = 'y'});
  mesh.faces = consistently_oriented(mesh.faces, mesh.vertices.rows());
  ASSERT_NO_THROW(check_flattenable(mesh, file.string()));
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const std::vector<char> cut =
      cut_to_disks(topology, std::vector<char>(static_cast<std::size_t>(topology.edges.rows()), 0),
                   edge_lengths(topology, mesh.vertices));
  FlattenOptions options;
  options.panel.iterations = 40;
  const FlatPattern pattern = flatten_apart(mesh, cut, options);
  const FlatMeasures measures = measure_flat(mesh, pattern);
  EXPECT_EQ(measures.inverted, 0);
  EXPECT_EQ(measures.overlaps, 0);
  EXPECT_LE(measures.seam_mismatch, 0.003);
  EXPECT_GE(pattern.cut.panel_count, 1);
  for (const PatternPiece& piece : lay_out_pattern(pattern).pieces) {
    EXPECT_FALSE(crosses_itself(piece.sew_line)) << piece.name;
  }
}

INSTANTIATE_TEST_SUITE_P(
    OfTheData, RealMeshes,
    ::testing::Values(
        "garments/diffcloth/tshirt1900.obj", "garments/diffcloth/skirt3448.obj",
        "garments/diffcloth/sock482.obj", "garments/diffcloth/dress-handsup-drape.obj",
        "garments/diffcloth/dress-v5k-f10k.obj", "garments/diffcloth/dress-v7k-f14k.obj",
        "garments/diffcloth/tshirt1900-flattened.obj", "makehuman/clothes/shoes06/shoes06.obj",
        "makehuman/clothes/female_sportsuit01/female_sportsuit01.obj",
        "makehuman/clothes/female_elegantsuit01/female_elegantsuit01.obj",
        "makehuman/clothes/male_casualsuit03/male_casualsuit03.obj",
        "makehuman/clothes/male_casualsuit04/male_casualsuit04.obj",
        "makehuman/clothes/male_elegantsuit01/male_elegantsuit01.obj"),
    [](const auto& one) {
      const std::string path = one.param;
      std::string name = path.substr(path.rfind('/') + 1);
      std::replace(name.begin(), name.end(), '-', '_');
      return name.substr(0, name.size() - 4);
    });

TEST(ConsistentlyOriented, FewFlippedFaces_AreTurnedRound) {
  const Mesh mesh = fixtures::sphere(2);
  Triangles mixed = mesh.faces;
  for (const int face : {3, 17, 18, 60}) {
    std::swap(mixed(face, 1), mixed(face, 2));
  }
  const Triangles oriented = consistently_oriented(mixed, mesh.vertices.rows());
  const Topology topology = topology_of(oriented, mesh.vertices.rows());
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  // The greater part keeps its side.
  EXPECT_EQ(oriented.row(0), mesh.faces.row(0));
}

TEST(ConsistentlyOriented, MoebiusStrip_IsStillRefused) {
  // Five quads round, the last one joined with a twist.
  Mesh strip;
  strip.vertices.resize(10, 3);
  strip.faces.resize(10, 3);
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * 3.14159265358979 * i / 5;
    for (int side = 0; side < 2; ++side) {
      const double out = 1 + 0.2 * (2 * side - 1) * std::cos(angle / 2);
      strip.vertices.row(2 * i + side) << out * std::cos(angle),
          0.2 * (2 * side - 1) * std::sin(angle / 2), out * std::sin(angle);
    }
    const int a = 2 * i;
    const int b = 2 * i + 1;
    const int c = i < 4 ? 2 * i + 2 : 1;
    const int d = i < 4 ? 2 * i + 3 : 0;
    strip.faces.row(2 * i) << a, b, c;
    strip.faces.row(2 * i + 1) << b, d, c;
  }
  strip.faces = consistently_oriented(strip.faces, 10);
  EXPECT_THROW(check_flattenable(strip), std::runtime_error);
}

}  // namespace
}  // namespace atelier
