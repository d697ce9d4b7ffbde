#pragma once

#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/tree.h"
#include "registration/tracking/cloth_energy.h"

namespace atelier {

/// The photometric term: the known texture of the cloth is compared with the current images, patch
/// by patch, by zero-mean normalised correlation, which is invariant to the brightness and contrast
/// of a patch and so to shading and exposure (Lucas and Kanade's image alignment, 1981, on a
/// surface and over all cameras at once).

/// One camera's image.
struct PhotoView {
  Camera camera;
  Image image;     ///< linear RGB or one channel, of the camera's size
  ByteImage mask;  ///< not 0 where the garment is, of the image's size; empty: unknown
};

/// An image pyramid, each level half the size of the previous one; values are square roots of
/// light, in which shot noise has the same variance everywhere.
struct ViewPyramid {
  Camera camera;
  std::vector<Image> levels;
  ByteImage mask;
};

/// Throws LogicError where sizes differ from the camera's.
ViewPyramid view_pyramid(const PhotoView& view, int levels);

/// The view after a high-pass filter: from each pixel of a level the mean of the garment's pixels
/// around it is subtracted, weighted by a tent of 2 `radius` pixels each way. The texture of the
/// cloth, which moves with it, remains; shading, which moves with folds, does not. Our choice.
/// Throws LogicError where the radius is not above 0.
ViewPyramid detail_view(const ViewPyramid& view, int radius);

/// Points spread evenly over the faces of a template.
struct ClothSamples {
  std::vector<int> offsets;                  ///< [F+1] into the rest
  std::vector<Eigen::Vector3f> barycentric;  ///< [S] of the face's corners
  std::vector<float> areas;                  ///< [S] m2
};

/// About `spacing` metres apart, at least one a face.
ClothSamples cloth_samples(const Points& vertices, const Triangles& faces, double spacing);

/// Colours of every sample at each level.
struct GarmentTexture {
  int channels = 3;
  std::vector<std::vector<float>> levels;  ///< [L] of [S, channels]
  std::vector<char> known;                 ///< [S] 0: no camera has seen it yet
};

/// Visibility of vertices in each view: facing it, not occluded, inside its image and mask.
/// @param occluders  trees over all that may occlude the garment, itself included
/// @return [views][V], cosine between normal and view, 0: not seen
std::vector<std::vector<float>> vertex_views(const Points& x, const Triangles& faces,
                                             const std::vector<ViewPyramid>& views,
                                             const std::vector<const TriangleTree*>& occluders);

/// Cloth with the views that see it. Refers to data that others own.
struct ViewedCloth {
  const Topology& topology;
  const Points& x;  ///< [V,3] m
  const std::vector<ViewPyramid>& views;
  const std::vector<std::vector<float>>& seen;  ///< of its vertices, by vertex_views
};

/// Adds the unknown samples of the texture, from those views that see them best.
/// @param sizes  number of levels, the largest first; 0: all
void add_texture(GarmentTexture& texture, const ClothSamples& samples, const ViewedCloth& cloth,
                 int sizes = 0);

struct PhotometricOptions {
  double weight = 1e-4;  ///< m2 against the scan's 1: of residuals in standard deviations
  double noise = 0.012;  ///< of an image's square roots; contrast below it is ignored
  double good = 0.6;     ///< correlation from which a view counts in full
  double bad = 0.2;      ///< correlation at which it does not count at all
};

/// The photometric term of cloth at x.
struct PhotometricTerm {
  std::vector<FaceQuadratic> quadratics;  ///< of the energy's second order, at origin x
  double energy = 0;                      ///< m4, at x, views and patches weighted as they are
  Eigen::VectorXd correlation;            ///< [V] mean over views; -1: no view
  Eigen::VectorXi views;                  ///< [V] that see the patch around each vertex
};

/// At one level of the images. O(samples x views that see them). In each view each patch is
/// compared with the best matching of several textures; later ones than the first have to match
/// clearly better. Empty textures are ignored.
PhotometricTerm photometric_term(const ViewedCloth& cloth, const ClothSamples& samples,
                                 const std::vector<const GarmentTexture*>& textures, int level,
                                 const PhotometricOptions& options = {});

}  // namespace atelier
