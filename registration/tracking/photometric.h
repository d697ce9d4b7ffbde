#pragma once

#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/tree.h"
#include "registration/tracking/cloth_energy.h"

namespace atelier {

/// The photometric term: the texture that cloth had where it was known is compared with what
/// cameras see of it now, patch by patch, each patch's brightness and contrast taken out, so that
/// shade, exposure and noise do not matter (the zero-mean normalised correlation of Lucas and
/// Kanade's image alignment, 1981, on a surface and over all cameras at once).

/// One camera's image.
struct PhotoView {
  Camera camera;
  Image image;     ///< linear RGB or one channel, of the camera's size
  ByteImage mask;  ///< not 0 where the garment is, of the image's size; empty: unknown
};

/// A view at several sizes, each half of the one before; values are square roots of light, in which
/// shot noise is alike everywhere.
struct ViewPyramid {
  Camera camera;
  std::vector<Image> levels;
  ByteImage mask;
};

/// Throws LogicError where sizes differ from the camera's.
ViewPyramid view_pyramid(const PhotoView& view, int levels);

/// The same view without what changes slowly over its images: of each pixel of a level, the mean of
/// the garment's pixels around it is taken away, in a tent of 2 `radius` pixels each way. What is
/// left is the cloth's own structure, which goes with it; shading, which goes with folds, is not.
/// Our choice. Throws LogicError where the radius is not above 0.
ViewPyramid detail_view(const ViewPyramid& view, int radius);

/// Points spread evenly over the faces of a template.
struct ClothSamples {
  std::vector<int> offsets;                  ///< [F+1] into the rest
  std::vector<Eigen::Vector3f> barycentric;  ///< [S] of the face's corners
  std::vector<float> areas;                  ///< [S] m2
};

/// About `spacing` metres apart, at least one a face.
ClothSamples cloth_samples(const Points& vertices, const Triangles& faces, double spacing);

/// How every sample looks at each size.
struct GarmentTexture {
  int channels = 3;
  std::vector<std::vector<float>> levels;  ///< [L] of [S, channels]
  std::vector<char> known;                 ///< [S] 0: no camera has seen it yet
};

/// Which vertices each view sees: facing it, hidden by nothing, inside its image and mask.
/// @param occluders  trees over all that may stand before the garment, itself included
/// @return [views][V], cosine between normal and view, 0: not seen
std::vector<std::vector<float>> vertex_views(const Points& x, const Triangles& faces,
                                             const std::vector<ViewPyramid>& views,
                                             const std::vector<const TriangleTree*>& occluders);

/// Cloth before cameras. Refers to what others own.
struct ViewedCloth {
  const Topology& topology;
  const Points& x;  ///< [V,3] m
  const std::vector<ViewPyramid>& views;
  const std::vector<std::vector<float>>& seen;  ///< of its vertices, by vertex_views
};

/// Fills in what is not known yet of the texture, from those views that see it best.
/// @param sizes  how many sizes of the images, the largest first; 0: all
void add_texture(GarmentTexture& texture, const ClothSamples& samples, const ViewedCloth& cloth,
                 int sizes = 0);

struct PhotometricOptions {
  double weight = 1e-4;  ///< m2 against the scan's 1: of residuals in standard deviations
  double noise = 0.012;  ///< of an image's square roots; contrast below it says nothing
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

/// At one size of the images. O(samples x views that see them). Each patch is compared in each view
/// with that of several textures which it matches best; later ones than the first have to match
/// clearly better. Empty textures are left out.
PhotometricTerm photometric_term(const ViewedCloth& cloth, const ClothSamples& samples,
                                 const std::vector<const GarmentTexture*>& textures, int level,
                                 const PhotometricOptions& options = {});

}  // namespace atelier
