#pragma once

#include <string>
#include <vector>

#include "core/finding.h"
#include "core/garment.h"
#include "core/options.h"
#include "registration/tracking/body_driven_prediction.h"
#include "registration/tracking/clear_of_body.h"
#include "registration/tracking/photometric.h"
#include "registration/tracking/printed_code.h"

namespace atelier {

/// Registers a garment's template to one frame: estimates the position of each of its vertices from
/// a labelled scan, the body and images (Xiang et al., "Dressing avatars", 2022; Pons-Moll et al.,
/// "ClothCap", 2017; Halimi et al., "Pattern-based cloth registration", 2022). Gauss-Newton from
/// coarse to fine: ICP on the shape alone, then with images, which observe tangential sliding.
struct RegisterOptions {
  int rounds = 10;             ///< of ICP: correspondences, then one Gauss-Newton step
  double reach = 0.10;         ///< m, maximum distance of correspondences in the first round
  double final_reach = 0.02;   ///< m, in the last round
  double rigid = 0.10;         ///< m, length over which the predicted shape is kept, first round
  double final_rigid = 0.02;   ///< m, last round
  double bend = 0.026;         ///< m, folds below this size are smoothed, first round
  double final_bend = 0.005;   ///< m, last round
  double stretch = 0.03;       ///< m: stretch of 1% weighs as much as a distance of 1% of this
  double compress = 0.02;      ///< m, the same of compressed edges
  double border_weight = 1;    ///< of correspondences of openings, relative to those of surfaces
  bool collision = true;       ///< keep cloth out of the body
  double gap = 0.002;          ///< m, minimum distance of cloth from the body
  bool photometric = true;     ///< photometric term from images
  int photometric_levels = 4;  ///< of the image pyramid, each half the size of the previous one
  int photometric_steps = 8;   ///< maximum steps at each level
  int photometric_detail = 2;  ///< pixels of each level within which images lose their mean
                               ///< (detail_view); 0: they are compared as they are
  double settled = 5e-5;       ///< m, mean step below which a level has converged; 0: never
  double photometric_weight = 3e-4;  ///< m2
  double sample_spacing = 0.005;     ///< m, spacing of the points on cloth at which colours compare
  bool code = true;                  ///< match coded prints (printed_code.h)
  double code_reach = 0.15;          ///< m, maximum sliding that a coded print corrects
  double code_weight = 1;            ///< of its matches, relative to the scan's 1
};
OptionTable describe(RegisterOptions& options);

/// A template prepared for registration: the part that does not depend on the frame.
struct RegistrationModel {
  ClothModel cloth;
  Points vertices;  ///< [V,3] m, in its own frame
  ClothSamples samples;
  PrintedCodebook code;  ///< of its print, from the template's frame; or empty
};

/// Throws DataError as cloth_model does.
RegistrationModel registration_model(const Garment& garment, const RegisterOptions& options = {},
                                     const std::string& file = "");

/// Observations of one frame.
struct RegistrationFrame {
  GarmentScan scan;                  ///< no faces: no observation
  BodyObstacle body;                 ///< no faces: unknown
  std::vector<ViewPyramid> views;    ///< none: only the shape is used
  std::vector<ViewPyramid> details;  ///< of `views`, to compare colours in; empty: `views` are
  TriangleTree other;                ///< other occluders (the rest of the scan), or empty
  /// [V] weight, relative to the scan's 1, of a prior against sliding away from `start`; or empty
  Eigen::VectorXd body_prior;
};

/// The views that colours are compared in.
inline const std::vector<ViewPyramid>& compared_views(const RegistrationFrame& frame) {
  return frame.details.empty() ? frame.views : frame.details;
}

struct RegisteredGarment {
  Points vertices;             ///< [V,3] m
  Eigen::VectorXf confidence;  ///< [V] in [0,1]: 0 no observation, 1 scan and images
  double scan_rms = 0;         ///< m, distance of vertices from their correspondences in the scan
  double support = 0;          ///< share of the garment's area with correspondences in the scan
  double correlation = 0;      ///< mean over visible vertices; 0 without views
  double seen = 0;             ///< share of vertices visible in at least two views
  int picture_steps = 0;       ///< photometric steps, at all levels
  int code_read = 0;           ///< accepted matches of the coded print
  int code_contradicted = 0;   ///< matches rejected because their neighbours disagree
  Eigen::VectorXd vertex_correlation;  ///< [V] 0 where not visible; empty without views
  double strain_p95 = 0;               ///< 95th percentile of |length / rest - 1|
  int inverted = 0;                    ///< inverted triangles (inverted_faces)
  BodyContact contact;                 ///< with the body of the frame; zeros without one
  std::vector<Finding> findings;
};

/// Inverted faces: those with a normal that points against the mean normal of the other faces that
/// share a vertex with them.
std::vector<int> inverted_faces(const Topology& topology, const Points& x);

/// Removes inversions: vertices of inverted faces move to the mean of their neighbours until no
/// face is inverted, in a neighbourhood that grows where faces stay inverted. A boundary vertex
/// with inverted faces only is mirrored at that mean, since its faces would otherwise shrink to
/// nothing. Vertices away from inverted faces do not move. Our choice.
/// @param x  [V,3] m
Points turned_back(const Topology& topology, Points x);

/// Registers one frame.
/// @param start    [V,3] m, predicted positions (predicted_cloth)
/// @param textures  the garment's texture so far (add_texture extends it), and any others that
///                  images are compared with (photometric_term)
RegisteredGarment register_garment(ShapeSolver& solver, const RegistrationModel& model,
                                   const Points& start, const RegistrationFrame& frame,
                                   const std::vector<const GarmentTexture*>& textures,
                                   const RegisterOptions& options = {});

/// Visibility of each vertex at x in each view, occluded by the garment itself, the body and
/// `frame.other`.
std::vector<std::vector<float>> garment_views(const RegistrationModel& model, const Points& x,
                                              const RegistrationFrame& frame);

}  // namespace atelier
