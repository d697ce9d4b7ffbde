#include "core/welded_faces.h"

#include <gtest/gtest.h>

#include "core/topology.h"

namespace atelier {
namespace {

// A tetrahedron with a vertex of its own for every corner of every face, as a texture's seams part
// it.
TEST(WeldedFaces, VerticesSplitAtSeams_AreJoined) {
  Points corners(4, 3);
  corners << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  Triangles whole(4, 3);
  whole << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
  Points parted(12, 3);
  Triangles faces(4, 3);
  for (int f = 0; f < 4; ++f) {
    for (int c = 0; c < 3; ++c) {
      parted.row(3 * f + c) = corners.row(whole(f, c));
      faces(f, c) = 3 * f + c;
    }
  }
  EXPECT_FALSE(is_closed(topology_of(faces, 12)));
  const Triangles welded = welded_faces(parted, faces);
  EXPECT_TRUE(is_closed(topology_of(welded, 12)));
  for (int f = 0; f < 4; ++f) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_LE(welded(f, c), faces(f, c)) << "the first at its place";
      EXPECT_EQ(parted.row(welded(f, c)), parted.row(faces(f, c)));
    }
  }
}

TEST(WeldedFaces, DistinctPositions_StaySeparate) {
  Points vertices(4, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 1e-12;
  Triangles faces(2, 3);
  faces << 0, 1, 2, 1, 3, 2;
  EXPECT_EQ(welded_faces(vertices, faces), faces);
  EXPECT_EQ(welded_faces(vertices, Triangles(0, 3)).rows(), 0);
}

}  // namespace
}  // namespace atelier
