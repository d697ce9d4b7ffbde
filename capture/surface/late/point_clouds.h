#pragma once

#include <vector>

#include "core/mesh.h"

// Of the late library `point_clouds`.

/// Vertices and triangles of Kazhdan's screened Poisson surface, untrimmed. One at a time: PCL's
/// octree keeps its nodes in static storage.
///
/// @param points  with normals
extern "C" void atelier_poisson_surface(const atelier::Mesh& points, int octree_depth,
                                        double point_weight, atelier::Mesh& surface);

/// Rows of the points whose mean distance from their neighbours is no outlier's.
///
/// @param points      with normals
/// @param neighbours  how many
/// @param sigma       standard deviations of the mean distances
extern "C" void atelier_sound_points(const atelier::Mesh& points, int neighbours, double sigma,
                                     std::vector<int>& rows);
