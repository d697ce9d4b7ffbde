#pragma once

#include <string>
#include <vector>

#include "core/types.h"

namespace atelier {

/// One edge of a panel: a straight line, a Bezier curve of degree 2 or 3, or an arc of a circle.
struct PanelEdge {
  int start = 0;                          ///< corner
  int end = 0;                            ///< corner
  std::vector<Eigen::Vector2d> controls;  ///< inner control points, 0 to 2, metres
  std::string name;  ///< of the opening that it borders ("neck", "hem"), "" if it is sewn
  /// Of an arc (without control points) the tangent of a quarter of its angle, as in DXF: positive
  /// if it runs counter-clockwise from start to end, 1 a semicircle; 0: no arc.
  double bulge = 0;
};

/// Where a panel waits before it is sewn: its plane (or, bent, a cylinder) in the world.
struct PanelPlacement {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< world position of the panel's (0, 0)
  Eigen::Vector3d rotation =
      Eigen::Vector3d::Zero();  ///< rotation vector: panel x, y, outside (+z)
  double bend_radius = 0;  ///< m; > 0: x runs round a cylinder about local y, axis at z = -radius
};

/// One flat piece of cloth. Its edges form one closed loop, counter-clockwise seen from outside;
/// the grain (warp) runs along +y.
struct Panel {
  std::string name;
  Points2 corners;               ///< [C,2] metres
  std::vector<PanelEdge> edges;  ///< edge i ends where edge i + 1 starts
  PanelPlacement placement;
};

/// Two edges sewn together over their whole length; if they differ in length, the longer is eased.
struct SewnEdges {
  std::string name;
  int panel_a = 0, edge_a = 0;
  int panel_b = 0, edge_b = 0;
  bool reversed = true;  ///< the start of a meets the end of b (both loops counter-clockwise)
};

/// Whether an edge is a straight line.
bool is_straight(const PanelEdge& edge);

/// A flat sewing pattern.
struct SewingPattern {
  std::string name;
  std::vector<Panel> panels;
  std::vector<SewnEdges> seams;
};

/// Throws DataError unless every panel is a closed, counter-clockwise loop that does not cross
/// itself (checked on its sampled outline), names are unique, every seam names edges that exist,
/// and no edge is sewn twice.
void check_sewing_pattern(const SewingPattern& pattern, const std::string& file = "");

/// `count + 1` points along an edge, evenly by arc length, ends exact.
Points2 sample_edge(const Panel& panel, int edge, int count);

/// Arc length of an edge, m.
double edge_length(const Panel& panel, int edge);

/// Area that a panel encloses, m2.
double panel_area(const Panel& panel);

/// Point of a panel placed in the world.
Eigen::Vector3d place(const PanelPlacement& placement, const Eigen::Vector2d& point_in_panel);

}  // namespace atelier
