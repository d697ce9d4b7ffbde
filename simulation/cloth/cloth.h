#pragma once

#include <string>
#include <vector>

#include "core/garment.h"
#include "core/options.h"
#include "simulation/cloth/schedule.h"

namespace atelier {

/// A spring between two particles: force `stiffness` (length - rest), along it.
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

/// Orthotropic membrane of one triangle, from its flat rest shape.
struct ClothStrain {
  int v0, v1, v2;
  double inverse_rest[4];    ///< rows u, v of the inverse of the flat edge matrix [1/m]
  double warp, weft, shear;  ///< N m: modulus times area
};

/// Where the vertices of a cloth may not go further than: long-range attachment (Kim et al. 2012).
struct ClothTether {
  int vertex;
  int anchor;     ///< a fixed vertex
  double length;  ///< m, the largest distance
};

/// How a garment becomes a Cloth.
struct ClothOptions {
  /// "springs": every edge is a spring (the usual mass-spring cloth; nu = 1/3, so its shear modulus
  /// follows from the stretch modulus). "strain": orthotropic triangles from the flat rest shape,
  /// with warp, weft and shear apart.
  std::string membrane = "springs";
  /// Further springs against shear: "none" (the triangles' own edges are the diagonals), "cross"
  /// (between the corners across every inner edge; adds `shear` to the membrane's modulus) or
  /// "quads" (pairs of triangles that form a rectangle: both diagonals get `shear` instead of the
  /// stretch modulus, so that shear and stretch are apart).
  std::string shear = "none";
  /// "flat": hinges want to be flat. "template": they want the angle of the 3D template.
  std::string rest_angles = "flat";
  double min_rest_angle = 0.5;  ///< deg; a triangle with a smaller corner is refused, 0.01 to 20
  double seam_stiffness = 500;  ///< N/m of each sewing spring, 1 to 1e6
  double max_hinge_weight =
      12;  ///< ceiling of l^2/(A1 + A2), so that slivers stay solvable, 2 to 1000
  double tether_stretch =
      0;  ///< tethers of this many times the geodesic length (1.01 to 2); 0: none
  ScheduleOptions schedule;
};
OptionTable describe(ClothOptions& options);

/// The immutable model of one piece of cloth (all panels and layers of one material): what
/// stretches, what bends, what everything weighs, and in which order it is solved.
///
/// Stiffnesses come from the membrane modulus and the mesh, so that refining changes nothing: a
/// spring has Y (A1 + A2) / l^2 (Van Gelder 1998; exact on the equilateral lattice), a hinge
/// B l^2 / (A1 + A2) (Grinspun et al. 2003; on the equilateral mesh the plate rigidity is exactly
/// B). A triangle of which all corners are fixed does not bend, so its area is left out there (our
/// choice): a strip is clamped exactly at the last row that is fixed. Hinges alone are a plate of
/// Poisson's ratio -1/3, so that a narrow strip that may curl across itself is softer by 1/9.
struct Cloth {
  Material material;
  Points rest_positions;  ///< [V,3] the template: where a simulation starts unless told otherwise
  Triangles faces;        ///< [F,3]
  std::vector<double> mass;          ///< [V] kg; 0 for a fixed vertex is not needed: see `fixed`
  std::vector<char> fixed;           ///< [V] 1: moved by Control alone (pins and attachments)
  std::vector<ClothSpring> springs;  ///< fibres, then shear springs, then sewing springs
  int fibre_count = 0;   ///< how many of the springs are mesh edges: strain is reported of these
  int sewing_begin = 0;  ///< springs from here on sew
  std::vector<ClothHinge> hinges;
  std::vector<ClothStrain> strains;
  std::vector<ClothTether> tethers;
  std::vector<Attachment> attachments;  ///< of fixed vertices that ride on body triangles
  std::vector<int> layer;               ///< [V] or empty: layers of clothes from the inside out
  Schedule schedule;  ///< over springs (kind 1), hinges (kind 0), strains (kind 2)
};

/// The model of a garment. `pins` are vertices that Control moves; vertices with attachments are
/// fixed too. Throws DataError for a garment that cannot be simulated: not manifold, degenerate or
/// too thin triangles, no mass, negative or non-finite material values, a stretching stiffness of 0
/// (shear and bending may be 0: it then shears or bends freely); LogicError for a pin that is no
/// vertex.
Cloth make_cloth(const Garment& garment, const std::vector<int>& pins = {},
                 const ClothOptions& options = {});

/// A cloth of given springs and point masses alone (chains, nets): no faces, no bending.
Cloth make_spring_net(const Points& positions, std::vector<double> mass,
                      std::vector<ClothSpring> springs, const std::vector<int>& pins,
                      const ScheduleOptions& schedule = {});

/// One cloth of several, one after the other; each keeps its constraints, and its layer is its
/// place in the list. All must have the same damping, friction and thickness (the first's are
/// used).
Cloth join_cloths(const std::vector<Cloth>& cloths, const ScheduleOptions& schedule = {});

/// Recomputes the schedule after constraints were changed by hand.
void rebuild_schedule(Cloth& cloth, const ScheduleOptions& options = {});

}  // namespace atelier
