#include "registration/tracking/garment_scan.h"

#include <gtest/gtest.h>

#include "tests/registration/registered_shapes.h"

namespace atelier {
namespace {

// Each of a scan's vertices pulls in one of so many steps, for all of them.
TEST(ScanRows, EveryNthVertex_AddsUpToAll) {
  const Mesh coarse = fixtures::cloth_tube(20, 10);
  const ClothModel model = cloth_model(coarse.vertices, coarse.faces);
  const TriangleTree tree = build_tree(coarse.vertices, coarse.faces);
  const Mesh fine = fixtures::cloth_tube(41, 23);
  const GarmentScan scan = garment_scan(fine, {});  // without labels all of it counts
  const auto sum_of = [&](int every, int first) {
    double sum = 0;
    for (const SurfaceRow& row :
         scan_rows(model, coarse.vertices, tree, scan, {.every = every, .first = first}).rows) {
      sum += row.vertices[0] == row.vertices[1] ? 0 : row.weight;
    }
    return sum;
  };
  EXPECT_NEAR((sum_of(3, 0) + sum_of(3, 1) + sum_of(3, 2)) / 3, sum_of(1, 0), 1e-12);
  EXPECT_NEAR(sum_of(3, 1), sum_of(1, 0), 0.05 * sum_of(1, 0));
}

}  // namespace
}  // namespace atelier
