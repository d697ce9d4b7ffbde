#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "capture/calibration/board.h"
#include "capture/calibration/find_board.h"
#include "capture/calibration/lens.h"
#include "core/camera.h"
#include "core/finding.h"
#include "core/options.h"

namespace atelier {

/// How much a lens may bend. `Auto` takes, for each camera, the model of least Bayesian information
/// criterion (Schwarz 1978) whose distortion can be inverted over the whole image.
enum class LensChoice { Auto, None, Radial1, Radial2, Brown4, Brown5, Rational, Fisheye };

struct CalibrateOptions {
  LensChoice lens = LensChoice::Auto;
  double loss = 1;    ///< px beyond which a corner counts less (Cauchy), (0, 100]; at least
                      ///< 2.4 deviations of what the corners turn out to be
  double reject = 4;  ///< views worse than this times the median view are left out, [1.5, 1000]
  double min_rejected = 1;  ///< px rms that is never left out, whatever the others are, [0, 1000]
  int min_views = 4;        ///< of a camera whose lens is not known, 3 to 1000
  int max_views = 60;  ///< of one camera that its lens is found from (spread evenly), 4 to 100000
  bool poses = true;   ///< false: lenses alone, each camera by itself
  double max_focal_deviation = 0.03;  ///< of the focal length, relative; beyond: not determined
};
OptionTable describe(CalibrateOptions& options);

/// A camera that is to be calibrated.
struct RigCamera {
  Camera camera;            ///< id and size; with `known`, its lens too
  bool known_lens = false;  ///< the lens is kept as it is
};

/// How well one camera is known.
struct CameraQuality {
  std::string lens;     ///< "brown4", ...: what was taken
  bool in_rig = false;  ///< it shares views with the others: its pose is known
  int views_seen = 0;   ///< in which the board was found
  int views_used = 0;
  int corners = 0;          ///< used
  double rms = 0, p95 = 0;  ///< px, over both coordinates together
  double coverage = 0;      ///< share of an 8 x 8 grid over the image that corners fall in
  LensNumbers lens_deviation = LensNumbers::Zero();              ///< standard deviations
  Eigen::Vector3d rotation_deviation = Eigen::Vector3d::Zero();  ///< rad, of the rotation vector
  Eigen::Vector3d centre_deviation = Eigen::Vector3d::Zero();    ///< m, against the first camera
  std::map<std::string, double> candidates;  ///< of Auto: information criterion of each model
};

/// A view that was left out, and why.
struct RejectedView {
  std::string camera_id;
  int frame_id = 0;
  std::string why;
};

struct Calibration {
  std::vector<Camera> cameras;         ///< all, in the order given; a pose only where in_rig
  std::vector<CameraQuality> quality;  ///< of each
  std::map<int, RigidNumbers> world_from_board;  ///< of each frame that was used
  std::vector<RejectedView> rejected;
  std::vector<Finding> findings;
  double rms = 0, p95 = 0;  ///< px, over all corners that were used
  double loss = 0;          ///< px: the loss's width in the end
  double sigma = 0;         ///< px: deviation of one coordinate that the residuals speak for
  bool converged = false;
  bool lenses_alone = false;  ///< no pose was looked for
  int points = 0;             ///< places of keypoints, where cameras were posed by them
};

/// Lenses by the views of each camera alone (Zhang 2000, refined with every distortion model that
/// is allowed), poses by chaining pairs of cameras that saw the same boards along the best spanning
/// tree (both poses that a small planar board can have are tried, and the views vote), then one
/// bundle adjustment of everything with robust loss; views that do not fit are left out and it is
/// done again. World: that of the first camera of the largest group, until `stand_up` turns it.
///
/// Without `poses` each camera is calibrated by itself: images of one number need not be of one
/// instant, symmetric boards will do, and every camera is at the origin. Otherwise two cameras of
/// which three and more views disagree about where they stand are not connected by them.
///
/// Findings: "calibration-no-board", "-few-views", "-unconnected", "-focal-open", "-converged",
/// "-coverage", "-residual", "-lens-folds". Cameras that cannot be calibrated are left as they
/// came, with an error among the findings; nothing that works is lost for them.
///
/// Throws DataError if no camera can be calibrated, or several cameras look at a board that
/// is_symmetric; LogicError for views of cameras that are not there, or of two sizes of arrays.
Calibration calibrate(const std::vector<RigCamera>& rig, const std::vector<BoardView>& views,
                      const BoardOptions& board, const CalibrateOptions& options = {});

/// Turns the rig into a world with Y up: the mean of the cameras' up axes is up; the origin lies
/// under the place that the cameras look at, or `ground_frame`'s board lies on the ground, its
/// middle at the origin and the cameras above it. Throws DataError if that frame was not used.
Calibration stand_up(Calibration calibration, const BoardOptions& board, int ground_frame = -1);

/// Adds what is wrong with the adjustment as a whole: "calibration-converged", "-residual".
void judge_adjustment(Calibration& result);

/// Root mean square and 95th percentile of lengths; 0 of none.
double root_mean_square(const std::vector<double>& lengths);
double percentile(std::vector<double> values, double share);

}  // namespace atelier
