#pragma once

#include <string>

#include "core/device.h"
#include "core/garment.h"

namespace atelier {

/// The drape test of Cusick 1968 (BS 5058): a round specimen hangs over a smaller round disk.
struct CusickOptions {
  double specimen_diameter = 0.30;  ///< m, 0.01 to 10
  double disc_diameter = 0.18;      ///< m, smaller
  int rings = 20;                   ///< of triangles from the centre to the rim, 6 to 200
  double seconds = 2;               ///< of hanging, 0.1 to 60
  int substeps = 30;                ///< of a sixtieth of a second, 1 to 10000
  std::string solver = "xpbd";      ///< one of solver_names()
  int iterations = 1;               ///< of a substep, of either
};

struct CusickDrape {
  double coefficient = 0;  ///< %, 0: hangs straight down, 100: does not bend
  double rest_speed = 0;   ///< m/s, of the fastest vertex at the end: how much at rest it was
  Mesh mesh;               ///< the part that hangs, at the end; the disk is round the origin, y = 0
};

/// Drape coefficient of a material: (projected area - disk) / (specimen - disk), in per cent.
/// The specimen is clamped between two disks, as in the instrument, and consists of
/// orthotropic triangles; it starts flat with a slight fixed unevenness, without which nothing
/// would decide where folds come. The area is counted in cells of half a millimetre of a 30 cm
/// specimen. Throws LogicError for options out of range, DataError as make_cloth and Solver::step.
CusickDrape cusick_drape(const Material& material, const CusickOptions& options = {},
                         Device device = Device::Cpu);

}  // namespace atelier
