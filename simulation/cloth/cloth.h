#pragma once

#include <string>
#include <vector>

#include "core/garment.h"
#include "core/options.h"
#include "simulation/cloth/schedule.h"

namespace atelier {

/// A spring between two particles, with the force `stiffness` (length - rest) along it.
struct ClothSpring {
  int a, b;
  double rest;       ///< m
  double stiffness;  ///< N/m
};

/// Resistance to bending at an edge: energy 1/2 stiffness (angle - rest)^2.
struct ClothHinge {
  int edge0, edge1;  ///< ends of the edge
  int left, right;   ///< opposite corners of (edge0, edge1, left) and (edge1, edge0, right)
  double rest;       ///< rad, 0 flat
  double stiffness;  ///< N m
};

/// Resistance to bending around a vertex: energy 1/2 stiffness |sum weight x|^2, linear in the
/// positions and at rest where the sum is zero. Only projective dynamics on the CPU has it.
struct ClothCurvature {
  std::vector<int> vertices;
  std::vector<double> weights;  ///< of each vertex; their sum is 0
  double stiffness;             ///< N m for weights in 1/m
};

/// Orthotropic membrane of one triangle, from its flat rest shape.
struct ClothStrain {
  int v0, v1, v2;
  double inverse_rest[4];    ///< rows u, v of the inverse of the flat edge matrix [1/m]
  double warp, weft, shear;  ///< N m: modulus times area
};

/// A bound on a vertex's distance from a fixed one: long-range attachment (Kim et al. 2012).
struct ClothTether {
  int vertex;
  int anchor;     ///< a fixed vertex
  double length;  ///< m, the largest distance
};

/// Options of make_cloth: how a garment is modelled as a Cloth.
struct ClothOptions {
  /// "springs": every edge is a spring (the usual mass-spring cloth; nu = 1/3, so its shear modulus
  /// follows from the stretch modulus). "strain": orthotropic triangles from the flat rest shape,
  /// with independent moduli for warp, weft and shear.
  std::string membrane = "springs";
  /// Further springs against shear: "none" (the triangles' own edges are the diagonals), "cross"
  /// (between the corners across every inner edge; adds `shear` to the membrane's modulus) or
  /// "quads" (pairs of triangles that form a rectangle: both diagonals get `shear` instead of the
  /// stretch modulus, so that shear is independent of stretch).
  std::string shear = "none";
  /// Rest angles of hinges. "flat": zero. "template": the angles of the 3D template.
  std::string rest_angles = "flat";
  double min_rest_angle = 0.5;  ///< deg; a triangle with a smaller corner is refused, 0.01 to 20
  double seam_stiffness = 500;  ///< N/m of each sewing spring, 1 to 1e6
  double max_hinge_weight =
      12;  ///< bound on l^2/(A1 + A2), which keeps slivers from becoming too stiff, 2 to 1000
  double tether_stretch =
      0;  ///< length of tethers as a multiple of the geodesic distance (1.01 to 2); 0: no tethers
  ScheduleOptions schedule;
};
OptionTable describe(ClothOptions& options);

/// The immutable model of one piece of cloth (all panels and layers of one material): its
/// constraints, masses, and the order in which constraints are solved.
///
/// Stiffnesses follow from the membrane modulus and the mesh, so that they do not depend on the
/// resolution: a spring has Y (A1 + A2) / l^2 (Van Gelder 1998; exact on the equilateral lattice),
/// a hinge B l^2 / (A1 + A2) (Grinspun et al. 2003; on the equilateral mesh the plate rigidity is
/// exactly B). The area of a triangle with three fixed corners is left out of its hinges, since it
/// does not bend (our choice): a strip is then clamped exactly at its last fixed row. Hinges alone
/// model a plate of Poisson's ratio -1/3, so that a narrow strip, free to curl across its width, is
/// softer by 1/9.
struct Cloth {
  Material material;
  Points rest_positions;             ///< [V,3] the template: where a simulation starts by default
  Triangles faces;                   ///< [F,3]
  std::vector<double> mass;          ///< [V] kg, also of fixed vertices
  std::vector<char> fixed;           ///< [V] 1: moved by Control alone (pins and attachments)
  std::vector<ClothSpring> springs;  ///< along mesh edges, then shear springs, then sewing springs
  int fibre_count = 0;   ///< number of springs along mesh edges, of which strain is reported
  int sewing_begin = 0;  ///< index of the first sewing spring
  std::vector<ClothHinge> hinges;
  std::vector<ClothCurvature> curvatures;  ///< make_cloth makes none
  std::vector<ClothStrain> strains;
  std::vector<ClothTether> tethers;
  std::vector<Attachment> attachments;  ///< of fixed vertices that move with body triangles
  std::vector<int> layer;               ///< [V] or empty: layers of clothes from the inside out
  Schedule schedule;  ///< over springs (kind 1), hinges (kind 0), strains (kind 2)
};

/// Builds the model of a garment. `pins` are vertices moved by Control; vertices with attachments
/// are fixed too. Throws DataError for a garment that cannot be simulated: not manifold, degenerate
/// or too thin triangles, no mass, negative or non-finite material values, a stretching stiffness
/// of 0 (shear and bending may be 0); LogicError for a pin that is no vertex.
Cloth make_cloth(const Garment& garment, const std::vector<int>& pins = {},
                 const ClothOptions& options = {});

/// A cloth made only of given springs and point masses (chains, nets), without faces and bending.
Cloth make_spring_net(const Points& positions, std::vector<double> mass,
                      std::vector<ClothSpring> springs, const std::vector<int>& pins,
                      const ScheduleOptions& schedule = {});

/// Joins several cloths into one, in order. Each keeps its constraints; its layer is its position
/// in the list. All must have the same damping, friction and thickness (the first's are used).
Cloth join_cloths(const std::vector<Cloth>& cloths, const ScheduleOptions& schedule = {});

/// Recomputes the schedule after constraints were changed by hand.
void rebuild_schedule(Cloth& cloth, const ScheduleOptions& options = {});

}  // namespace atelier
