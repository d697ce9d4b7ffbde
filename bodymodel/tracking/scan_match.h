#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bodymodel/tracking/frame_energy.h"
#include "core/mesh.h"
#include "core/tree.h"

namespace atelier {

/// Role of a scan point for the body under it.
enum class ScanPart : std::uint8_t {
  Skin,     ///< the body itself, also under tight minimal clothing
  Cloth,    ///< clothing: the body is inside
  Ignored,  ///< nothing: hair, what is carried
  LeftOut,  ///< nothing either: clothing that the caller leaves out
};

/// A scan as oriented points with areas.
struct ScanPoints {
  Points points;                ///< [N,3] metres
  Points normals;               ///< [N,3] unit, outwards; zero where unknown
  Eigen::VectorXd areas;        ///< [N] m2
  std::vector<ScanPart> parts;  ///< [N]
};

/// The vertices of a scan that have a normal. `parts` has an entry for each vertex or, where
/// nothing is known, none: then all is clothing. Throws LogicError on another length.
ScanPoints scan_points(const Mesh& scan, const std::vector<ScanPart>& parts = {});

/// A finding about the size of a scan of a person whose rest pose has these vertices, one sentence;
/// "" if nothing: it is less than 3 times as large, or 6 times as small.
std::string scan_size_problem(const ScanPoints& scan, const Points& person);

/// About `count` of the points, evenly over the area (systematic sampling along the scan's own
/// order; `turn` chooses other ones). All if there are no more. O(N).
ScanPoints sampled(const ScanPoints& scan, Index count, int turn = 0);

/// A posed body ready for questions.
struct BodySurface {
  Points vertices;  ///< [V,3] metres
  Points normals;   ///< [V,3]
  TriangleTree tree;
};
/// The person's surface in rest pose, and moved to a pose (the tree keeps its shape). O(V).
BodySurface rest_surface(const FittedPerson& person);
BodySurface posed_surface(const FittedPerson& person, const BodySurface& rest,
                          const Eigen::VectorXd& x);

struct MatchOptions {
  double reach = 0.08;      ///< m, a point further from the body is not of it, [1e-3, 10]
  double min_cosine = 0.4;  ///< of the angle between both normals, [-1, 1]
};

/// The nearest point of the body for every point of the scan that is skin or cloth, within reach
/// and with normals that agree. Clothing whose nearest vertex is in `region` is left out. Weights
/// are shares of the scan's area. `region` has V entries or none. O(N log F).
std::vector<SurfaceMatch> match_scan(const FittedPerson& person, const BodySurface& surface,
                                     const ScanPoints& scan, const std::vector<char>& region,
                                     const MatchOptions& options = {});

/// A scan that can be asked for its nearest point.
struct ScanLookup {
  TriangleTree tree;   ///< of all points
  double spacing = 0;  ///< m, mean distance of neighbouring points
};
/// O(N log N). A scan without points gives an empty one.
ScanLookup scan_lookup(const ScanPoints& scan);

/// Which vertices of the body ask for what the scan has there.
struct AskingVertices {
  Index count = 0;  ///< about so many, spread evenly over the body; 0: all
  int turn = 0;     ///< chooses other ones
};

/// The other way: the nearest point of the scan for vertices of the body, which have `areas` [V] m2
/// (of the body at rest). Only skin is matched, within reach
/// and with normals that agree; vertices that look at a hole or past the scan's border (their
/// nearest point lies sideways) are left out. Weights are shares of the scan's area.
/// O(count log N).
std::vector<SurfaceMatch> match_model(const BodySurface& surface, const Eigen::VectorXd& areas,
                                      const ScanPoints& scan, const ScanLookup& lookup,
                                      const AskingVertices& asking,
                                      const MatchOptions& options = {});

/// Root mean square distance, metres, of matches along their normals from a posed body's vertices
/// [V,3], and how much of the scan they are.
struct MatchError {
  double rms = 0;
  double share = 0;
};
MatchError match_error(const Points& vertices, const std::vector<SurfaceMatch>& matches);

inline constexpr double kFarShare = 0.3;  ///< of a scan off the body, that is worth a word

/// How much of a scan's area, of what the caller has not left out, is no part of a posed body: more
/// than 40 cm off it, or ignored; [0, 1], by some hundred of its points.
double foreign_share(const FittedPerson& person, const BodySurface& surface,
                     const ScanPoints& scan);

}  // namespace atelier
