#pragma once

#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

struct SurfaceOptions {
  int neighbours = 12;       ///< of each point, whose mean distance tells outliers
  double outlier_sigma = 3;  ///< standard deviations of that distance beyond which a point goes
  int octree_depth = 8;      ///< of the Poisson system: 2^depth cells along the longest side
  double point_weight = 4;   ///< how closely the surface keeps to the points (screening)
  double trim = 0.012;       ///< m from the nearest point beyond which the surface is cut away;
                             ///< where points are sparse, 2.5 times their spacing if that is more
  double min_component_area = 0.002;  ///< m2: pieces of less area are dropped
  double edge_length =
      0.01;  ///< m, of the isotropic triangles of the result; 0: as Poisson leaves them
};
OptionTable describe(SurfaceOptions& options);

/// The points without those that stand alone: farther from their neighbours than `outlier_sigma`
/// standard deviations above the mean (PCL, StatisticalOutlierRemoval).
Mesh without_outliers(const Mesh& points, const SurfaceOptions& options = {});

/// A surface through oriented points: screened Poisson (Kazhdan and Hoppe 2013, PCL's), cut away
/// where no point supports it and where pieces are small, remeshed to isotropic triangles (CGAL),
/// with colours, labels and confidence of the nearest points. Where the surface goes on beyond the
/// last of them, farther than points lie apart, confidence is 0. Trimmed regions stay open: holes
/// are boundary loops.
///
/// Throws DataError for fewer than 100 points, or points without normals. Cost: dominated by the
/// Poisson system, some seconds for a hundred thousand points.
Mesh surface_from_points(const Mesh& points, const SurfaceOptions& options = {});

}  // namespace atelier
