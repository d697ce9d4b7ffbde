#pragma once

#include <optional>
#include <string>

#include "simulation/cloth/cloth.h"

namespace atelier {

/// The values of a material that the solver uses, which depend on the membrane (ClothOptions).
struct MembraneInUse {
  double warp = 0;        ///< Young's modulus along the grain [N/m]
  double weft = 0;        ///< across it [N/m]
  bool averaged = false;  ///< both are the mean: there is no flat rest shape to tell them by
  std::optional<double> poisson;  ///< none where further springs against shear decide it
  std::optional<double> shear;    ///< N/m, of triangles or further springs; none: it follows
  double bending = 0;             ///< N m
};

/// Of a garment as make_cloth takes it: springs of triangles have Poisson's ratio 1/3, strain
/// triangles 0 and a shear modulus of their own.
MembraneInUse membrane_in_use(const Garment& garment, const ClothOptions& options);

/// "Young's modulus 646 N/m (mean of warp and weft: no flat rest shape), Poisson's ratio 1/3,
/// bending 1e-05 N m".
std::string text_of(const MembraneInUse& membrane);

/// The modulus alone, for captions: "646", or "1060/232" of warp and weft [N/m], each times
/// `factor`.
std::string modulus_text(const MembraneInUse& membrane, double factor = 1);

}  // namespace atelier
