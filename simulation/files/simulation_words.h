#pragma once

#include <cmath>
#include <string>

#include "simulation/files/material_file.h"

namespace atelier {

/// A length [m] as it is said: "5.6 mm", "56.2 m".
inline std::string length_text(double metres) {
  return std::abs(metres) < 1 ? number_text(1e3 * metres) + " mm" : number_text(metres) + " m";
}

}  // namespace atelier
