#pragma once

#include "core/camera.h"
#include "core/device.h"
#include "core/image.h"
#include "core/raster_math.h"
#include "core/types.h"

namespace atelier {

/// A camera's view of a mesh, per pixel centre.
struct Raster {
  ImageOf<int> face;           ///< [H,W] the nearest face, -1: none
  ImageOf<float> barycentric;  ///< [H,W,3] perspective-correct, of the face's corners; 0 where none
  ImageOf<float> depth;        ///< [H,W] metres along the camera's axis; infinity where none
};

struct RasterOptions {
  double near = 0.01;      ///< metres; nothing nearer to the camera's plane is drawn; 1e-6..1e6
  bool cull_back = false;  ///< leave out faces seen from behind
};

/// Rasterises triangles.
///
/// Coverage is exact: vertices are rounded to 1/4096 pixel, edge functions are whole numbers, and a
/// pixel centre on a shared edge belongs to exactly one of the two faces (top-left rule). Of
/// several faces the one of least depth (rounded to float) wins, then the lowest. Faces are clipped
/// at the near plane. Both devices give the same bits, on any number of threads.
///
/// Distortion: vertices are projected with it, edges between them are straight in the distorted
/// image, and barycentrics are those of that image; the error is of second order in a face's
/// size. Faces with a vertex that cannot be projected (nearer than `near`, or where the distortion
/// has folded over) are left out whole. To be exact, undistort the images and rasterise without.
///
/// Throws LogicError unless faces name existing vertices, coordinates are finite and below 1e100 m,
/// options are in range; DataError for a camera that check_camera refuses or a side above 32768
/// pixels. O(F + covered pixels). On CUDA one warp draws one face: many small faces are quick, a
/// few that fill the image are not.
Raster rasterize(const Points& vertices, const Triangles& faces, const Camera& camera,
                 const RasterOptions& options = {}, Device device = Device::Cpu);

/// Vertices as the raster sees them: what `rasterize` starts with, computed here for both devices.
std::vector<ScreenVertex> screen_vertices(const Points& vertices, const Camera& camera,
                                          double near);

}  // namespace atelier
