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

/// Registers a garment's template to one frame: where each of its vertices is in a labelled scan,
/// on a body, in images (Xiang et al., "Dressing avatars", 2022; Pons-Moll et al., "ClothCap",
/// 2017; Halimi et al., "Pattern-based cloth registration", 2022). Gauss-Newton from coarse to
/// fine: first the shape alone, then images too, which find what slides along the surface.
struct RegisterOptions {
  int rounds = 10;             ///< of nearest points and one step each, for the shape
  double reach = 0.10;         ///< m, of nearest points in the first round
  double final_reach = 0.02;   ///< m, in the last
  double rigid = 0.10;         ///< m, length over which the predicted shape is kept at first
  double final_rigid = 0.02;   ///< m, at last
  double bend = 0.026;         ///< m, below which folds are smoothed at first
  double final_bend = 0.005;   ///< m, at last
  double stretch = 0.03;       ///< m: stretch of 1% weighs as much as a distance of 1% of this
  double compress = 0.02;      ///< the same of cloth that is shorter than at rest
  double border_weight = 1;    ///< of openings against surfaces
  bool collision = true;       ///< keep cloth out of the body
  double gap = 0.002;          ///< m, between cloth and body
  bool photometric = true;     ///< let images say what slides along the surface
  int photometric_levels = 4;  ///< sizes of images, each half of the one before
  int photometric_steps = 8;   ///< steps at each size, fewer where it settles
  double settled = 5e-5;       ///< m: it has settled where a step moves cloth less (mean); 0: never
  double photometric_weight = 3e-4;  ///< m2
  double sample_spacing = 0.005;     ///< m between points whose colours are compared
  bool code = true;                  ///< read prints that are nowhere alike
  double code_reach = 0.15;          ///< m, how far such a print may have slid
  double code_weight = 1;            ///< of what was read against the scan's 1
};
OptionTable describe(RegisterOptions& options);

/// A template made ready: nothing in it depends on the frame.
struct RegistrationModel {
  ClothModel cloth;
  Points vertices;  ///< [V,3] m, in its own frame
  ClothSamples samples;
  PrintedCodebook code;  ///< what its print says in the frame where it is known; or empty
};

/// Throws DataError as cloth_model does.
RegistrationModel registration_model(const Garment& garment, const RegisterOptions& options = {},
                                     const std::string& file = "");

/// What is known of one frame.
struct RegistrationFrame {
  GarmentScan scan;                ///< no faces: nothing was seen
  BodyObstacle body;               ///< no faces: unknown
  std::vector<ViewPyramid> views;  ///< none: only the shape is used
  TriangleTree other;              ///< what else hides the garment (the rest of the scan), or empty
  /// [V] against the scan's 1: what keeps the start from sliding where it is known to be right; or
  /// empty
  Eigen::VectorXd body_prior;
};

struct RegisteredGarment {
  Points vertices;             ///< [V,3] m
  Eigen::VectorXf confidence;  ///< [V] in [0,1]: 0 nothing says where it is, 1 scan and images
  double scan_rms = 0;         ///< m, of vertices to the scan they were matched with
  double support = 0;          ///< share of the garment's area that the scan speaks of
  double correlation = 0;      ///< mean over vertices that views see; 0 without
  double seen = 0;             ///< share of vertices that two views compare
  int picture_steps = 0;       ///< that images took, of all sizes
  int code_read = 0;           ///< places whose print said which they are
  int code_contradicted = 0;   ///< places whose print said otherwise than those around them
  Eigen::VectorXd told;        ///< [V] correlation, 0 where no view compares; empty without views
  double strain_p95 = 0;       ///< of |length / rest - 1|
  int inverted = 0;            ///< triangles turned against their neighbours
  BodyContact contact;         ///< with the body of the frame; zeros without one
  std::vector<Finding> findings;
};

/// Which faces are turned against those around them: the normal points against the mean normal of
/// the faces that share a vertex with it, itself left out.
std::vector<int> inverted_faces(const Topology& topology, const Points& x);

/// Vertices of faces that are turned over go to the middle of their neighbours, until none is; what
/// stays turned takes more and more of its neighbourhood along. A boundary's vertex all of whose
/// faces are turned goes to the other side of that middle, towards which its faces would only
/// shrink until nothing is left of them. What is far from such faces keeps its place. Our choice.
/// @param x  [V,3] m
Points turned_back(const Topology& topology, Points x);

/// @param start    [V,3] m, where the garment is likely to be (predicted_cloth)
/// @param texture  what it looks like; not changed: add_texture fills it in
RegisteredGarment register_garment(ShapeSolver& solver, const RegistrationModel& model,
                                   const Points& start, const RegistrationFrame& frame,
                                   const GarmentTexture& texture,
                                   const RegisterOptions& options = {});

/// Which vertices each view sees at x, hidden by itself, the body and the rest.
std::vector<std::vector<float>> garment_views(const RegistrationModel& model, const Points& x,
                                              const RegistrationFrame& frame);

}  // namespace atelier
