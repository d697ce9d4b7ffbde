#pragma once

#include <cstddef>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/render/render.h"

namespace atelier {

/// The surface point that each pixel's centre sees, of the meshes (not of the ground). All maps
/// have the camera's size; where nothing is seen, ids are -1 and numbers 0.
struct SurfaceMaps {
  ImageOf<int> mesh;  ///< place in Scene::meshes
  ImageOf<int> face;  ///< of that mesh
  Image barycentric;  ///< 3 channels, weights of the face's corners
  Image depth;        ///< metres along the camera's axis (its frame's z, not the ray's length)
  Image position;     ///< 3 channels, metres in the world
  Image normal;       ///< 3 channels, unit, world, outward (by the faces' winding), as shaded
  Image uv;           ///< 2 channels, v up; 0 for meshes without uvs
};

/// One ray through each pixel's centre, exactly through the lens. Of the scene's first `meshes`
/// alone: the others hide them, but are themselves nothing. The same bytes on any number of
/// threads. Throws DataError for a camera that check_camera refuses.
SurfaceMaps surface_maps(const PreparedScene& scene, const Camera& camera,
                         std::size_t meshes = static_cast<std::size_t>(-1));

/// For each point whether the camera sees it: it projects into the image and nothing lies between
/// it and the camera but within `tolerance` metres of it. O(points) rays.
std::vector<bool> visible_points(const PreparedScene& scene, const Camera& camera,
                                 const Points& points, double tolerance = 1e-3);

}  // namespace atelier
