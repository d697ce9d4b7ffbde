#pragma once

#include "core/mesh.h"
#include "registration/template/garment_cover.h"
#include "registration/template/template_points.h"

namespace atelier {

/// The part of a surface that was kept, and which of it no point supports.
struct TrimmedSurface {
  Mesh mesh;
  int holes_closed = 0;     ///< patches without points that were kept, those under 1 cm2 aside
  double area_closed = 0;   ///< m2 of them
  double area_carried = 0;  ///< m2 that points of other frames support (add_carried)
  double area_made_up = 0;  ///< m2 that the frames' cover of the body supports, and no point does
};

/// Cuts a surface through points (surface_through_points) off where the garment ends, along a
/// smooth line.
///
/// A place is supported where it lies beside a point, within `spacing` along the surface, and looks
/// the way the point does; beside what is cut off, within half of `spacing`, so that the surface
/// ends where its points end. A patch without support is kept where it is a hole: nearly all that
/// surrounds it is supported. It is cut off where it runs to the rim, lies over bare skin or goes
/// 1 cm into the body, as lids of openings do. Of what was cut off for that alone, gaps are kept
/// that the garment goes round but for their ends, as one that nobody saw from a cuff to the hem:
/// those parts that make the rim shorter by more than 10 times their area over covered skin, 40
/// times elsewhere (1/m; gaps up to 20 and 5 cm wide), where they go in from it by more than 2 cm.
/// Pieces under a tenth of the largest are dropped.
TrimmedSurface trim_surface(const Mesh& surface, const GarmentPoints& points, double spacing,
                            const Points& body, const Triangles& body_faces,
                            const GarmentCover& cover);

/// The mesh without pieces of less than `share` of the area of the largest, and without vertices
/// that no face uses.
Mesh without_small_pieces(const Mesh& mesh, double share);

}  // namespace atelier
