#pragma once

#include <cstdint>

#include "core/mesh.h"
#include "registration/template/garment_cover.h"

namespace atelier {

/// Oriented points that say where a garment's surface is.
struct GarmentPoints {
  Points points;            ///< [N,3] metres
  Points normals;           ///< [N,3] unit, outwards
  Eigen::VectorXd weights;  ///< [N] 1: seen in this frame
  Index seen = 0;           ///< the first so many are seen in this frame
  Index observed = 0;       ///< so many are seen in this frame or others (add_carried), the rest
                            ///< is made up from the body
};

/// The points of one label in a scan, thinned to means over cubes of `spacing` metres.
///
/// Left out: what nobody saw (confidence 0), small islands of the label (under 2% of its area),
/// surface that faces the body with another side close behind it, which is the inside of loose
/// cloth, and points whose normals cancel. Our choice. No points where the label is not in the
/// scan.
GarmentPoints garment_points(const Mesh& scan, std::uint8_t label, const Points& body,
                             const Triangles& body_faces, double spacing);

/// Where no frame shows anything, what the cover of the body by all frames suggests, with little
/// weight: covered places take points on the body at the gap of the cover where that is at most
/// 0.04 m and nothing is observed within `spacing` times 5. Our choice. Nothing for no points.
void add_covered(GarmentPoints& cloud, const Points& body, const Triangles& body_faces,
                 const GarmentCover& cover, double spacing);

}  // namespace atelier
