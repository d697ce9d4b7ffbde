#pragma once

#include "core/types.h"

namespace atelier {

/// Normals and areas of triangle surfaces. All throw LogicError where a face names a vertex that
/// is not there. One pass each; the sums run in order of the faces, so that results repeat.

/// Unit normal of each face, [F,3]; zero for a face without area.
Points face_normals(const Points& vertices, const Triangles& faces);

/// Area of each face, square metres, [F].
Eigen::VectorXd face_areas(const Points& vertices, const Triangles& faces);

/// Unit normal of each vertex, [V,3]: face normals weighted by the angle at the vertex, which does
/// not depend on how the surface is triangulated (Thürmer and Wüthrich, "Computing vertex normals
/// from polygonal facets", JGT 1998). Zero where the normals cancel or there is no face.
Points vertex_normals(const Points& vertices, const Triangles& faces);

/// A third of the area of the faces around each vertex, square metres, [V]. Sums to the total.
Eigen::VectorXd vertex_areas(const Points& vertices, const Triangles& faces);

}  // namespace atelier
