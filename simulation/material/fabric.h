#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/garment.h"

namespace atelier {

/// A fabric with the values that were measured of one, and where they are from.
///
/// Sources:
///   W  Wang, O'Brien and Ramamoorthi 2011, "Data-driven elastic models for cloth: modeling and
///      measurement", their database of ten fabrics: areal density, stretching and shear (we take
///      the stiffest of the measured strains, for the tangent at rest of a knit is that of loose
///      loops; the stiffer yarn is called warp), bending (mean of the three directions at rest;
///      read as a plate's rigidity). Every number was compared with the database's own files, as
///      ARCSim hands them on: denim is 11oz-black-denim, jersey gray-interlock, rib-knit
///      ivory-rib-knit, ponte camel-ponte-roma, satin white-dots-on-blk, microfibre
///      tango-red-jet-set.
///   K  "Regenerated cellulose-based denim fabric for tropical regions", Journal of Textiles 2016,
///      4614168, table 5: KES-F of six denims, shear 1.5 to 3.4 gf/(cm deg), thickness 0.8 to 1.2
///      mm; not read again since it was noted down.
///   P  Penava et al. 2014, table 1, weight and thickness of a cotton and a wool weave;
///   second-hand,
///      from a transcription.
///   M  Memon et al. 2021, "Study on effect of leather rigidity and thickness on drapability of
///      sheep garment leather", Materials 14(16) 4553: thickness 0.64 to 0.96 mm, drape coefficient
///      47 to 70 %.
///   D  calibrated: chosen such that the drape coefficient of the fabric
///      (tests/simulation/cusick_drape.h) lies within what is published for its kind, by either
///      solver.
/// A quantity without a letter is estimated. So silk has no measured value at all; of the five that
/// the drape test judges, the bending of silk, cotton, wool and leather is calibrated to it, and
/// denim's, which was measured, is predicted. Damping and friction are estimated throughout.
struct Fabric {
  std::string_view name;
  std::string_view summary;  ///< what it is, and the source of each value
  Material material;
  double drape_low = 0, drape_high = 100;  ///< Cusick drape coefficient of its kind [%]
};

/// Every fabric that has a name.
std::span<const Fabric> all_fabrics();

/// Their names, "custom" first: for `--material`.
std::vector<std::string> fabric_names();

/// The material of that name. Throws LogicError for another one.
Material fabric_material(std::string_view name);

/// The prior: the logarithms of the fabrics' stiffnesses are about a mean, as if normal. One
/// stretching stiffness of a fabric is the geometric mean of warp and weft.
struct StiffnessPrior {
  double stretch = 0;         ///< N/m, median
  double stretch_spread = 0;  ///< standard deviation of its natural logarithm; 0: nothing is usual
  double bending = 0;         ///< N m, median
  double bending_spread = 0;  ///< standard deviation of its natural logarithm; 0: nothing is usual
};

/// That of the fabrics that have a name.
StiffnessPrior stiffness_prior();

}  // namespace atelier
