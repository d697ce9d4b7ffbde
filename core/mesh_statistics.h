#pragma once

#include <optional>
#include <vector>

#include "core/mesh.h"

namespace atelier {

struct MeshStatisticsOptions {
  /// Which quantiles of the edge lengths to give, each in [0, 1]; 0 is the shortest edge, 1 the
  /// longest, 0.5 the median.
  std::vector<double> edge_quantiles = {0, 0.05, 0.5, 0.95, 1};
};

/// Statistics of a mesh: for a first look at data, and to notice when they change.
struct MeshStatistics {
  Index vertices = 0;
  Index faces = 0;
  Index edges = 0;
  Index components = 0;             ///< pieces, a vertex without faces included
  Index boundary_loops = 0;         ///< holes and rims whose faces agree on a side
  double boundary_length = 0;       ///< of all edges with one face, metres
  Index non_manifold_edges = 0;     ///< with three faces or more
  Index inconsistent_edges = 0;     ///< between faces of opposite orientation
  Index degenerate_faces = 0;       ///< a vertex twice
  Index flat_faces = 0;             ///< of three vertices on one line, or in one place
  Index isolated_vertices = 0;      ///< in no face
  double area = 0;                  ///< square metres
  std::optional<double> volume;     ///< cubic metres, negative if inside out; only if closed
  Eigen::Vector3d lowest{0, 0, 0};  ///< bounds of the vertices, metres
  Eigen::Vector3d highest{0, 0, 0};
  int first_flat_face = -1;          ///< -1: none
  std::vector<double> edge_lengths;  ///< the quantiles asked for, metres; empty without edges
};

/// Throws DataError as `check_mesh` does, LogicError for a quantile outside [0, 1]. Quantiles are
/// of the sorted lengths, linearly interpolated. O(F log F).
MeshStatistics mesh_statistics(const Mesh& mesh, const MeshStatisticsOptions& options = {});

/// Metres; 0 of a mesh without edges. O(F).
double mean_edge_length(const Mesh& mesh);

}  // namespace atelier
