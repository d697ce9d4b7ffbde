#pragma once

#include <string>
#include <vector>

#include "simulation/cloth/cloth.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/solver_options.h"

namespace atelier::fixtures {

/// The other program's material: springs of one stiffness, and a bend at every inner vertex. The
/// sequence's description has 3025 N/m and 4e-4 N m. `forces` measures both from the file alone:
/// what moves the cloth below a ring of the skirt is what springs and bends across it pull. It
/// finds 57 N/m and 4e-4 N m, and 3025 is 55 squared.
constexpr double kForeignSpring = 55;  // N/m, unless --spring says else
constexpr double kForeignBend = 4e-4;  // N m
/// What the description does not say: how far from the body its contacts begin (cloth comes from
/// far to 6 mm, and stops by 4.5 mm), and its damping by air, 5e-5 kg/s of every vertex, over a
/// vertex's mean mass.
constexpr double kForeignDistance = 6e-3;  // m
constexpr double kForeignDamping = 0.87;   // 1/s

/// A cloth and a body that another program moved; the cloth's seams are closed.
struct ForeignSequence {
  std::vector<Points> body, cloth;  ///< of each frame
  Triangles body_faces;
  double spring = kForeignSpring;  ///< N/m
  Garment garment;                 ///< template: the first frame; rest: the flat panel
  std::vector<int> attached;
  double fps = 30;
};

/// Reads a sequence.npz (bench/projective_tables.cpp); `spring`: N/m of an edge.
ForeignSequence read_foreign(const std::string& file, double spring = kForeignSpring);

/// The other program's bends, at every inner vertex of a garment with a flat panel. Their weights
/// are near to mean value coordinates (Floater 2003): the tangents of half the angles on both sides
/// of the way to a neighbour, over its length. But on one side the angle is that at the triangle's
/// third corner, so that rows of a flat mesh are only zero where it is even. At rest they are zero.
std::vector<ClothCurvature> foreign_curvatures(const Garment& garment, double stiffness);

/// Its cloth as any solver has it: hinges of about the same stiffness. On an equilateral lattice of
/// edge l a row of the program's bends is sqrt(3) l times the sum of both curvatures, and a vertex
/// has 0.87 l^2: B = 2 sqrt(3) k.
Cloth foreign_cloth(const ForeignSequence& sequence, const ClothOptions& options = {});
/// The same with the program's own bends in place of hinges.
Cloth published_cloth(const ForeignSequence& sequence);
/// The program's steps, iterations and contacts.
SolverOptions foreign_options();
/// Where the sequence begins, with velocities from its first three frames.
ClothState start_of(const ForeignSequence& sequence);

/// Frames 0 to `last`; `advance(control)` moves the cloth by one.
template <class Advance>
void replay(const ForeignSequence& sequence, int last, const Advance& advance) {
  for (int f = 0; f < last; ++f) {
    Control control;
    control.body_start = sequence.body[static_cast<std::size_t>(f)];
    control.body_end = sequence.body[static_cast<std::size_t>(f) + 1];
    control.pin_targets = sequence.cloth[static_cast<std::size_t>(f) + 1];
    advance(control, f + 1);
  }
}

/// What a frame looks like as a whole.
struct ClothFigures {
  double strain = 0;      ///< mean |length / flat length - 1| of edges
  double area = 0;        ///< m2
  double silhouette = 0;  ///< m2, shadow along z
  double hem = 0;         ///< m, height of the lowest twentieth of vertices
};

ClothFigures figures_of(const Points& x, const Cloth& flat);

}  // namespace atelier::fixtures
