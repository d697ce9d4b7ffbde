#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/tree.h"
#include "registration/tracking/cloth_energy.h"

namespace atelier {

/// The part of a labelled scan that is one garment, ready to be asked.
struct GarmentScan {
  Points vertices;           ///< [S,3] m
  Triangles faces;           ///< [G,3]
  Points normals;            ///< [S,3] unit, of the whole scan's surface
  Eigen::VectorXd areas;     ///< [S] m2
  std::vector<char> border;  ///< [S] 1 where the part ends: an opening, a neighbour or a hole
  Points conormals;          ///< [S,3] of border vertices: unit, in the surface, out of the part
  TriangleTree tree;         ///< over the faces
  TriangleTree border_tree;  ///< over these vertices; `face` is a row of border_vertices
  std::vector<int> border_vertices;  ///< of the border but where another garment lies over it
};

struct GarmentScanOptions {
  double min_component_area =
      0.01;  ///< share of the garment's area below which a loose piece is dropped
};

/// Faces all of whose corners have one of the labels, or the scan no labels, and were seen: where
/// the scan says how sure it is, confidence above 0. No faces where nothing is so. Throws DataError
/// (with `file`) as check_mesh does.
GarmentScan garment_scan(const Mesh& scan, const std::vector<std::uint8_t>& labels,
                         const std::string& file = "", const GarmentScanOptions& options = {});

/// A part without the openings at which another garment of the same scan lies over it: there the
/// cloth goes on, and where it seems to end says nothing of it. Which of two that touch (within 2
/// cm) is on top is asked of all places where they do: the one whose surface 1.5 cm off the border
/// is farther from the body, on average. Our choice. Nothing changes where the body or the other is
/// empty.
GarmentScan without_covered_border(GarmentScan part, const GarmentScan& other,
                                   const TriangleTree& body);

/// [V] 1 at the cloth's rim where the border of the scan's part next to it is covered: the garment
/// goes on there. @param x  [V,3] m, where the cloth lies on the scan
std::vector<char> covered_rim(const Topology& topology, const Points& x, const GarmentScan& scan);

/// How the scan pulls at cloth, annealed from round to round.
struct ScanRowOptions {
  double reach = 0.05;         ///< m; farther apart they have nothing to do with each other
  double scale = 0.02;         ///< m, at which distances count as outliers
  double same_way = 0.3;       ///< least cosine between the normals of points that correspond
  double weight = 1;           ///< of both directions together
  double border_weight = 1;    ///< of the openings' edges against it
  double border_reach = 0.03;  ///< m
  int every = 1;               ///< of the scan's vertices one in so many pulls, for all of them
  int first = 0;               ///< the first that does, below `every`
};

/// Correspondences of cloth at x with a scan.
struct ScanRows {
  std::vector<SurfaceRow> rows;
  Eigen::VectorXd support;  ///< [V] in [0,1]: how much of each vertex's area has a scan near it
};

/// Rows both ways, cloth to scan and scan to cloth, and of boundaries. @param tree  over the cloth
/// at x. O((V + S) log).
ScanRows scan_rows(const ClothModel& model, const Points& x, const TriangleTree& tree,
                   const GarmentScan& scan, const ScanRowOptions& options);

/// A body that cloth may not enter.
struct BodyObstacle {
  Points vertices;    ///< [B,3] m
  Triangles faces;    ///< [.,3]
  Points normals;     ///< [B,3] unit
  TriangleTree tree;  ///< empty: no body
};
BodyObstacle body_obstacle(const Points& vertices, const Triangles& faces);

struct BodyRowOptions {
  double gap = 0.002;    ///< m that cloth keeps from the body
  double reach = 0.04;   ///< m, the deepest penetration that is mended
  double weight = 10;    ///< against the scan's 1
  bool centres = false;  ///< rows for triangles' centres too, where a body rises between vertices
};

/// A row for every vertex that is nearer to the body than the gap, or inside of it.
std::vector<SurfaceRow> body_rows(const ClothModel& model, const Points& x,
                                  const BodyObstacle& body, const BodyRowOptions& options);

}  // namespace atelier
