#pragma once

#include <cstdint>
#include <vector>

#include "registration/template/clothed_frames.h"
#include "registration/template/template_points.h"

namespace atelier {

/// A garment's surface in the pose of one frame, and where it is in others.
struct FollowedSurface {
  /// One of the others.
  struct Frame {
    Index row = 0;
    Points vertices;     ///< [V,3] m
    Points body;         ///< [B,3] m
    double support = 0;  ///< share of the surface that the frame's scan shows
    double beyond = 0;   ///< share of what it shows of the garment that lies past the rim
  };
  std::uint8_t label = 0;     ///< of the garment
  Mesh mesh;                  ///< in the pose of its own frame
  std::vector<Frame> frames;  ///< in the order of their rows; its own is not among them
};

/// Whether a frame shows three quarters of a surface or more, as where it was followed well: cloth
/// beside one that was lost says nothing of its rims.
bool is_followed_well(const FollowedSurface::Frame& frame);

/// Of `beyond`, over the frames in which the surface was followed well; 0 where it was in none.
double median_beyond(const FollowedSurface& followed);

/// Follows a surface through `rows`, outwards from the frame whose pose it has (`home`, skipped
/// among the rows), each from the one before: predicted_cloth, then register_garment by shape
/// alone. The surface needs no more vertices than its folds ask for: 3 cm apart will do.
/// Throws DataError as cloth_model does.
FollowedSurface followed_surface(const Mesh& surface, Index home, const ClothedFrames& frames,
                                 const std::vector<Index>& rows, std::uint8_t label);

/// Oriented points.
struct OrientedPoints {
  Points points;   ///< [N,3] m
  Points normals;  ///< [N,3] unit
};

/// Points carried along with a surface that moves: each by the rigid motions of the vertices near
/// it (edge_rotations), weighted by a Gaussian of the distance that is 3 cm wide, or half the
/// distance of the nearest, and by how far normals agree. So points past the rim, or over a hole,
/// move on with what is next to them. Embedded deformation (Sumner et al. 2007) with our weights.
/// @param from  [V,3] m, vertices where the points are; @param to  [V,3] m, where they go
OrientedPoints carried(const OrientedPoints& points, const Triangles& faces, const Points& from,
                       const Points& to);

/// What the own frame of a surface does not show of a garment, taken from the others: points of
/// their scans (garment_points), carried to its pose, where its own points are missing. They are
/// put behind those of the own frame, with half their weight.
///
/// A point is missing 1.5 `spacing` or more from the frame's own, measured along the surface, if
/// what is missing there goes on for 2 cm and, at its deepest, for 3.5 cm: less is the error of
/// following, and so is what lies past the median of a whole rim. Two frames have to show it, where
/// more than two were followed. Left out is what lies off the surface by more than 3 cm and half
/// its way from its rim, what the own frame shows to be something else, and what lies within 4 cm
/// of the body where that is not covered (share below 0.8). Our choice. Frames in which the surface
/// was not followed well are not asked.
/// @param cloud  seen points of the own frame alone
/// @param cover  of the body, by all frames
/// @return m2 that were added, about
double add_carried(GarmentPoints& cloud, const ClothedFrame& own, const GarmentCover& cover,
                   const FollowedSurface& followed, const ClothedFrames& frames, double spacing);

}  // namespace atelier
