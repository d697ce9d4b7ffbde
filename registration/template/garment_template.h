#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/garment.h"
#include "core/options.h"
#include "registration/template/body_anatomy.h"
#include "registration/template/texture_atlas.h"

namespace atelier {

/// A clothed person at one instant.
struct ClothedFrame {
  Mesh scan;    ///< labelled surface, triangles counter-clockwise from outside
  Points body;  ///< [V,3] m, vertices of the body under the clothes
};

/// Frames of a clothed person, loaded when asked for.
struct ClothedFrames {
  Triangles body_faces;
  BodyAnatomy anatomy;
  std::vector<int> frame_ids;
  std::function<ClothedFrame(Index frame_idx)> load;
};

struct GarmentTemplateOptions {
  double edge_length = 0.018;  ///< m of the triangles' edges, 0.003 to 0.1; 12 keep an opening
  int frame = -1;              ///< the frame in whose pose the template is; -1: the best
  int frames = 16;             ///< looked at, evenly over all, 1 to 10000
  double reach = 0.05;         ///< m: unseen patches up to twice as wide are closed, 0.01 to 0.5
  double stiffness = 0.02;     ///< of the surface against its points, 1e-6 to 1e3
  double clearance = 0.002;    ///< m that it keeps from the body, 0 to 0.1
  double dynamic = 0.03;       ///< m off from moving with the body: more hangs free, 0.001 to 1
  TextureAtlasOptions atlas;
};
OptionTable describe(GarmentTemplateOptions& options);

/// A garment as registration needs it.
struct GarmentTemplate {
  Garment garment;   ///< mesh in the pose of the frame, boundaries, attachments, uvs
  int frame_id = 0;  ///< whose pose it has
  /// Where the body looks in it, horizontal, of length 1; zero where it lies (body_facing).
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();
  std::vector<char> dynamic;  ///< [V] 1: hangs free from the body
  int holes_closed = 0;       ///< where nothing was seen
  double area_unseen = 0;     ///< m2 of the surface that this frame's scan does not show
  int pushed_out = 0;         ///< vertices that were inside of the body or nearer than clearance
  std::vector<Finding> findings;
};

/// A clean single-layer mesh of the garment with one label, from labelled scans.
///
/// The frame is the one that shows most of the garment's area and has fewest covered places of the
/// body face another limb within 5 cm (arms away, legs apart). Its points, and where it shows
/// nothing the cover of the body by all frames (garment_points), get a surface that goes on
/// smoothly (surface_through_points), which is cut off where the garment ends (trim_surface) and
/// where parts of it are bridged (remove_handles, loops up to 15 cm). Remaining loops that no limb
/// passes through are closed (garment_boundaries), the mesh is made even (isotropic_remeshing),
/// without slivers (remove_slivers.h), and pushed out of the body. Vertices move with the body's
/// nearest triangles (attach_to_body); where riding misses the scans of the frames by more than
/// `dynamic` (median), or the body is twice as far away, the garment hangs free. Warns
/// (`opening-lost`) where the mesh is too coarse for an opening of the surface.
///
/// Throws DataError where no frame shows 0.01 m2 of the label, where more than 0.6 of the surface
/// was not seen, and where `frame` is none of the frames; LogicError as check_anatomy.
/// @param name  of the garment, also in what is thrown
GarmentTemplate garment_template(const ClothedFrames& frames, std::uint8_t label,
                                 const std::string& name,
                                 const GarmentTemplateOptions& options = {});

/// A mesh that an artist made, as a template in the pose of a frame: boundaries named, attachments,
/// an atlas where it has no texture coordinates. It must be placed on the frame's body. One whose
/// faces all look inwards, to the body, is turned round, with a note (`import-turned`).
///
/// Throws DataError where no frame shows 0.01 m2 of the label, and for edges of three faces or
/// more, edges of opposite orientation and vertices where fans touch (with the place of the first),
/// several pieces, a closed surface, a size that is not that of clothing for this body (a file in
/// other units), and a mesh that is not on the body: half its vertices farther than 0.3 m, or not
/// the garment's: half farther from what the scan shows of that than a twentieth of its size
/// (diagonal). Warns (`import-far`) where half of what the scan shows of the garment is farther
/// than 10 cm from it.
GarmentTemplate imported_template(const Mesh& mesh, const ClothedFrames& frames, std::uint8_t label,
                                  const std::string& name,
                                  const GarmentTemplateOptions& options = {},
                                  const std::string& file = "");

}  // namespace atelier
