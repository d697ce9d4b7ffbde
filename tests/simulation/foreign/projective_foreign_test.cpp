// Projective dynamics beside the cloth of the method's authors' program.
#include <cmath>

#include <gtest/gtest.h>

#include "simulation/contact/crossings.h"
#include "simulation/projective/projective.h"
#include "tests/simulation/foreign/foreign_skirt.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

// From the same start, on the same body and with the same springs and bends, as published without
// acceleration: their cloth, 20 frames on.
TEST(ProjectiveForeign, AuthorsSkirt_MovesAsByTheirProgram) {
  ATELIER_TEST_FILE(file, "other_simulator/sequence.npz");
  const fixtures::ForeignSequence sequence = fixtures::read_foreign(file.string());
  const Cloth cloth = fixtures::published_cloth(sequence);
  SolverOptions options = fixtures::foreign_options();
  options.projective.acceleration = 0;
  ProjectiveSolver solver(cloth, sequence.body_faces, options);
  solver.set_state(fixtures::start_of(sequence));
  const int last = 20;
  fixtures::replay(sequence, last, [&](const Control& control, int) { solver.advance(control); });
  const Points x = solver.state().positions;
  const Points& other = sequence.cloth[last];
  const double distance = (x - other).rowwise().norm().mean();
  EXPECT_LT(distance, 0.006);
  const fixtures::ClothFigures ours = fixtures::figures_of(x, cloth);
  const fixtures::ClothFigures theirs = fixtures::figures_of(other, cloth);
  EXPECT_NEAR(ours.strain / theirs.strain, 1, 0.05);
  EXPECT_NEAR(ours.area / theirs.area, 1, 0.05);
  EXPECT_NEAR(ours.silhouette / theirs.silhouette, 1, 0.05);
  EXPECT_NEAR(ours.hem, theirs.hem, 0.006);
  EXPECT_EQ(count_crossings(x, cloth.faces), 0);
  RecordProperty("distance_mm", std::to_string(1e3 * distance));
}

}  // namespace
}  // namespace atelier
