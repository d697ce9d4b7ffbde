#include "simulation/material/membrane_in_use.h"

#include <cstdio>

namespace atelier {
namespace {

std::string modulus_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

MembraneInUse membrane_in_use(const Garment& garment, const ClothOptions& options) {
  const Material& m = garment.material;
  MembraneInUse out;
  out.warp = m.stretch_warp;
  out.weft = m.stretch_weft;
  out.bending = m.bending;
  if (garment.rest_faces.rows() == 0) {
    out.averaged = m.stretch_warp != m.stretch_weft;
    out.warp = out.weft = 0.5 * (m.stretch_warp + m.stretch_weft);
  }
  if (options.membrane == "strain") {
    out.poisson = 0;
    out.shear = m.shear;
  } else if (options.shear != "none") {
    out.shear = m.shear;
  } else {
    out.poisson = 1.0 / 3;
  }
  return out;
}

std::string text_of(const MembraneInUse& membrane) {
  std::string text = "Young's modulus ";
  text += membrane.warp == membrane.weft ? modulus_number(membrane.warp) + " N/m"
                                         : modulus_number(membrane.warp) + " N/m (warp), " +
                                               modulus_number(membrane.weft) + " N/m (weft)";
  if (membrane.averaged) {
    text += " (mean of warp and weft: no flat rest shape)";
  }
  text += ", Poisson's ratio ";
  text += !membrane.poisson ? "by the shear springs" : *membrane.poisson > 0 ? "1/3" : "0";
  text += membrane.shear ? ", shear " + modulus_number(*membrane.shear) + " N/m" : "";
  return text + ", bending " + modulus_number(membrane.bending) + " N m";
}

std::string modulus_text(const MembraneInUse& membrane, double factor) {
  const std::string warp = modulus_number(factor * membrane.warp);
  return membrane.warp == membrane.weft ? warp
                                        : warp + "/" + modulus_number(factor * membrane.weft);
}

}  // namespace atelier
