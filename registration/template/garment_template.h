#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/garment.h"
#include "core/options.h"
#include "registration/template/clothed_frames.h"
#include "registration/template/frame_scores.h"
#include "registration/template/texture_atlas.h"

namespace atelier {

/// Scans that a template is made of.
enum class TemplateSource {
  Frame,  ///< the scan of one frame, and the cover of the body by the others
  Take    ///< also what that frame hides and others show
};

struct GarmentTemplateOptions {
  double edge_length = 0.018;  ///< m, 0.003 to 0.1; an opening needs a perimeter of 12 edges
  int frame = -1;              ///< the frame that gives the template its pose; -1: the best
  int frames = 16;             ///< number of frames used, evenly spaced, 1 to 10000
  TemplateSource source = TemplateSource::Take;
  double reach = 0.05;       ///< m, half the width of unseen gaps that are closed, 0.01 to 0.5
  double stiffness = 0.02;   ///< smoothness of the surface against its points, 1e-6 to 1e3
  double clearance = 0.002;  ///< m, minimum distance from the body, 0 to 0.1
  double dynamic = 0.03;     ///< m, error of moving with the body above which cloth is free
  TextureAtlasOptions atlas;
};
OptionTable describe(GarmentTemplateOptions& options);

/// A garment as registration needs it.
struct GarmentTemplate {
  Garment garment;                 ///< mesh in the pose of the frame, boundaries, attachments, uvs
  int frame_id = 0;                ///< the frame of its pose
  std::vector<FrameScore> scores;  ///< of the frames among which it was chosen
  /// Horizontal unit vector that the body faces in it; zero for a person lying down (body_facing).
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();
  std::vector<char> dynamic;  ///< [V] 1: hangs freely, 0: moves with the body
  int holes_closed = 0;       ///< number of closed gaps of the observations
  double area_carried = 0;    ///< m2 of the surface that was taken from other frames' scans
  double area_unseen = 0;     ///< m2 of the surface that no scan shows
  double beyond = 0;  ///< share of what frames show of the garment that it lacks, median of those
                      ///< in which it was followed well
  double observed_rims = 1;  ///< share of its rims where frames show that it ends (observed_rims)
  bool whole = true;         ///< nothing is missing that the take shows, no opening without a name
  int pushed_out = 0;        ///< vertices that were inside the body or nearer than `clearance`
  std::vector<Finding> findings;
};

/// A clean single-layer mesh of the garment with one label, from labelled scans.
///
/// The frame is the one of the best score (take_overview): it shows most of the garment, with
/// fewest hands at it, folds, and limbs that face each other. A smooth surface
/// (surface_through_points) is fitted to its points and, where nothing is shown, to the distances
/// of cloth from the body in all frames (garment_points, add_covered). It is trimmed at the
/// garment's ends (trim_surface), and bridges between its parts are cut (remove_handles, loops up
/// to 15 cm). That surface is followed through the other frames (followed_surface), what they show
/// and it lacks is carried to its pose (add_carried), and it is made again, twice at most, until
/// under 1% of its area is gained. Loops that no limb passes through in most frames are closed
/// (garment_boundaries). The mesh is remeshed (isotropic_remeshing, remove_slivers.h) and moved out
/// of the body. Vertices are attached to the nearest triangles of the body (attach_to_body); where
/// this motion misses the scans of the frames by more than `dynamic` (median), or the body is twice
/// as far away, the garment hangs freely. Warns (`opening-lost`) where the mesh is too coarse for
/// an opening, and (`not-whole`) where more than 4% of what the frames show lies past its rims, a
/// quarter of those ends where no frame shows that cloth ends (observed_rims), or an opening has no
/// name.
///
/// Throws DataError where no frame shows 0.01 m2 of the label, where more than 0.6 of the surface
/// was not seen, and where `frame` is none of the frames; LogicError as check_anatomy.
/// @param name  of the garment, also in error messages
GarmentTemplate garment_template(const ClothedFrames& frames, std::uint8_t label,
                                 const std::string& name,
                                 const GarmentTemplateOptions& options = {});

/// An artist's mesh as a template in the pose of a frame: with named boundaries, attachments, and a
/// texture atlas if it has no texture coordinates. It must be placed on the frame's body. A mesh
/// with all faces oriented towards the body is reoriented, with a note (`import-turned`).
///
/// Throws DataError where no frame shows 0.01 m2 of the label, and for edges of three faces or
/// more, edges of opposite orientation and non-manifold vertices (with the position of the first),
/// several pieces, a closed surface, a size that is implausible for this body (a file in other
/// units), a mesh that is not on the body (half its vertices farther than 0.3 m), and one that is
/// not on the garment (half its vertices farther from the garment's part of the scan than a
/// twentieth of its diagonal). Warns (`import-far`) where half of that part of the scan is farther
/// than 10 cm from the mesh.
GarmentTemplate imported_template(const Mesh& mesh, const ClothedFrames& frames, std::uint8_t label,
                                  const std::string& name,
                                  const GarmentTemplateOptions& options = {},
                                  const std::string& file = "");

}  // namespace atelier
