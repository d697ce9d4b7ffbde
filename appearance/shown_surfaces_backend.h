#pragma once

#include "appearance/picture_math.h"
#include "appearance/shown_surfaces.h"

namespace atelier {

/// Operations on surfaces of both devices (shown_surfaces.cpp).

/// Faces [F,3] of all, into the vertices of all.
Triangles faces_of_all(const std::vector<ShownSurface>& surfaces);
/// Throws LogicError unless there are as many vertices as the surfaces have together.
void require_shown_vertices(const std::vector<ShownSurface>& surfaces, const Points& vertices);
/// Layers without the arrays that lie on the device. Throws LogicError unless each has a look.
std::vector<PictureLayer> picture_layers(const std::vector<ShownSurface>& surfaces,
                                         const std::vector<SurfaceLook>& looks);
PictureStyle picture_style(const PaintOptions& options, const Eigen::Vector3d& eye);

/// Of surfaces that make_shown_surfaces has checked.
std::unique_ptr<ShownSurfaces> make_cuda_shown_surfaces(std::vector<ShownSurface> surfaces,
                                                        const PaintOptions& options);

}  // namespace atelier
