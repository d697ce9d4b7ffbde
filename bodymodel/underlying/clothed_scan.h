#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh.h"
#include "core/winding_number.h"

namespace atelier {

/// Role of a part of a scan for the body beneath.
enum class ScanRole : std::uint8_t {
  Ignored,  ///< nothing of its own: background, unknown; inside and outside still count it
  Skin,     ///< the body itself
  Cloth,    ///< outside of the body, close to it where it is tight
  Cover,    ///< outside of the body, at no known distance: hair, shoes, hats
};

/// A scan of a clothed person, as fits of the body see it: an open surface with a role for every
/// vertex. The reader of labels (capture/label_taxonomy.h) assigns roles to labels.
struct ClothedScan {
  Mesh mesh;                    ///< vertices, faces; metres
  std::vector<ScanRole> roles;  ///< [V]; empty: nothing is known, all of it counts as Cloth
};

/// A part of a scan that can be asked for its nearest point.
struct ScanRegion {
  TriangleTree tree;                 ///< over `faces`
  Triangles faces;                   ///< into the scan's vertices
  std::vector<ScanRole> face_roles;  ///< [F]
  std::vector<std::uint8_t> border;  ///< [F] bit k: edge k, bit 3 + k: corner k is on the border
};

/// A scan prepared for queries: normals, areas, trees, winding numbers.
struct ScanSurface {
  Points vertices;
  Points normals;               ///< [V,3]
  Eigen::VectorXd areas;        ///< [V] m2
  std::vector<ScanRole> roles;  ///< [V]
  ScanRegion skin;
  ScanRegion cover;     ///< Cloth and Cover
  WindingTree winding;  ///< of all faces; empty if there are none
};

/// Makes it ready. A face has the role of two of its corners; with three different ones it is in
/// no region. A scan without vertices is fine (nothing was seen). Throws DataError, with `file`,
/// for numbers that are not finite, indices out of range, a scan without faces, and roles that
/// are not one a vertex. O(F log F).
ScanSurface scan_surface(const ClothedScan& scan, const std::string& file = "");

/// Nearest point of a region.
struct ScanPoint {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;  ///< interpolated from the scan's vertices, unit length
  double distance = 0;     ///< m
  bool border = false;     ///< on the region's border, beyond which nothing is known
  ScanRole role = ScanRole::Ignored;
};

/// Nearest point of the region within `reach` metres; nothing if there is none, or if its normal
/// cannot be told.
std::optional<ScanPoint> nearest_point(const ScanSurface& scan, const ScanRegion& region,
                                       const Eigen::Vector3d& query, double reach);

/// How inside is told from outside.
enum class CoverSign {
  Winding,   ///< generalised winding number of the whole scan (Jacobson et al. 2013)
  Normal,    ///< normals of the cloth (for comparison: turned faces and folds mislead it)
  Unsigned,  ///< not at all (for comparison: skin then stays outside where it once is)
};

/// The cover of a point of skin.
struct CoverGap {
  Eigen::Vector3d point;    ///< nearest, metres
  Eigen::Vector3d outward;  ///< along the way between skin and cloth, out of the body, unit length
  double gap = 0;           ///< m; negative where the skin is outside
  ScanRole role = ScanRole::Cloth;
};

/// The gap between a point of skin with an outward normal and what covers it within `reach` metres.
///
/// CoverSign::Winding takes the skin for inside if the scan's winding number falls across the
/// cloth, from the skin's side to the other, each a centimetre from it or as far as the skin is,
/// and for outside if it rises. It asks no normal of the scan, so that spikes, folds and patches of
/// turned faces of less than that do not turn the sign, nor do holes, which add to both sides: of a
/// shoe without a sole no more than 0.2 to 0.4 is inside, but -0.6 outside (a half, as closed
/// surfaces have it, is no bound of open ones).
/// Cloth over skin lies where the skin looks if it is inside, and behind it if not; what lies
/// elsewhere belongs to another limb or is the skin's own far side, and is nothing. Nearer than a
/// millimetre the skin's normal stands for the way to the cloth. CoverSign::Normal and
/// CoverSign::Unsigned tell another limb's cloth by where the cloth looks. Nothing at a rim.
/// O(log F).
std::optional<CoverGap> cover_gap(const ScanSurface& scan, const Eigen::Vector3d& skin,
                                  const Eigen::Vector3d& normal, double reach, CoverSign sign);

/// True where skin looks from inside at a cover within `reach` metres: a leg at its skirt.
/// O(log F).
bool looks_at_cover(const ScanSurface& scan, const Eigen::Vector3d& skin,
                    const Eigen::Vector3d& normal, double reach);

/// Share of the scan's area that is farther than `reach` metres from the body: somebody else's, or
/// of another place. 0 of a scan without area. O(V log F).
double share_off_body(const ScanSurface& scan, const Triangles& faces, const Points& body,
                      double reach = 0.4);

/// Throws DataError if the scan cannot be of this body: more than three times as tall, less than a
/// tenth, or its middle farther off than the body is tall, which tells millimetres, inches and
/// other origins. Scans without vertices pass.
void check_scan_of_body(const ClothedScan& scan, const Points& body, const std::string& file = "");

}  // namespace atelier
