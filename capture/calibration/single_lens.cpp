#include "capture/calibration/single_lens.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <set>

#include "capture/calibration/board_pose.h"
#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

LensMask mask(std::initializer_list<int> distortion) {
  LensMask free{};
  free[0] = free[1] = free[2] = free[3] = true;
  for (const int i : distortion) {
    free[static_cast<std::size_t>(4 + i)] = true;
  }
  return free;
}

/// Focal length with the principal point in the middle: least squares over the two constraints that
/// each homography gives. 0 where the views do not say (all parallel to the image).
double focal_from_homographies(const Camera& camera, const std::vector<BoardView>& views,
                               const BoardPoints& points) {
  // h1' w h2 = 0 and h1' w h1 = h2' w h2 with w = diag(1, 1, f^2) / f^2 after centring: both are
  // linear in 1/f^2.
  double squares = 0;
  double products = 0;
  for (const BoardView& view : views) {
    std::vector<cv::Point2d> from;
    std::vector<cv::Point2d> to;
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      from.emplace_back(points(view.ids[i], 0), points(view.ids[i], 1));
      to.emplace_back((view.pixels(row, 0) - 0.5 * camera.width) / camera.width,
                      (view.pixels(row, 1) - 0.5 * camera.height) / camera.width);
    }
    const cv::Mat h = cv::findHomography(from, to);
    if (h.empty()) {
      continue;
    }
    const auto column = [&](int c) {
      return Eigen::Vector3d(h.at<double>(0, c), h.at<double>(1, c), h.at<double>(2, c));
    };
    Eigen::Vector3d h1 = column(0);
    Eigen::Vector3d h2 = column(1);
    const double scale = 0.5 * (h1.norm() + h2.norm());
    h1 /= scale;
    h2 /= scale;
    const double a[] = {h1.x() * h2.x() + h1.y() * h2.y(),
                        h1.head<2>().squaredNorm() - h2.head<2>().squaredNorm()};
    const double b[] = {-h1.z() * h2.z(), -(h1.z() * h1.z() - h2.z() * h2.z())};
    for (int i = 0; i < 2; ++i) {
      squares += a[i] * a[i];
      products += a[i] * b[i];
    }
  }
  const double inverse = squares > 0 ? products / squares : 0;
  return inverse > 0 ? camera.width / std::sqrt(inverse) : 0;
}

Bundle bundle_of(const Camera& camera, const LensModel& model, const std::vector<BoardView>& views,
                 const std::vector<RigidNumbers>& poses, const BoardPoints& points) {
  Bundle bundle;
  bundle.points = points;
  Bundle::Eye eye;
  eye.model = model.distortion;
  eye.lens = lens_of(camera);
  eye.free = model.free;
  eye.fixed_pose = true;
  eye.centre = {0.5 * camera.width, 0.5 * camera.height};
  eye.centre_prior = 0.1 * camera.width;  // no lens is mounted further off
  bundle.eyes = {eye};
  bundle.world_from_board = poses;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (std::size_t i = 0; i < views[v].ids.size(); ++i) {
      bundle.sights.push_back({0, static_cast<int>(v), views[v].ids[i],
                               views[v].pixels.row(static_cast<Eigen::Index>(i)).transpose()});
    }
  }
  return bundle;
}

int free_count(const LensMask& free) {
  return static_cast<int>(std::count(free.begin(), free.end(), true));
}

/// Robust cost as a sum of squares: that of Cauchy's loss.
double cost_of(const Bundle& bundle, double loss) {
  const auto errors = reprojection_errors(bundle);
  double sum = 0;
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    sum += loss * loss * std::log1p(errors.row(i).squaredNorm() / (loss * loss));
  }
  return sum;
}

/// Bayesian information criterion of a fit with this cost, over `count` numbers measured.
double criterion_of(double cost, double count, const LensModel& model) {
  return count * std::log(std::max(cost, 1e-12) / count) + free_count(model.free) * std::log(count);
}

struct Fit {
  Camera camera;
  std::vector<RigidNumbers> poses;
  double criterion = std::numeric_limits<double>::infinity();
  double rms = std::numeric_limits<double>::infinity();  ///< px, robust
  bool usable = false;
};

Fit fit_model(const Camera& start, const LensModel& model, const std::vector<BoardView>& views,
              const std::vector<RigidNumbers>& poses, const BoardPoints& points,
              const CalibrateOptions& options) {
  const BundleSolution solution =
      solve_bundle(bundle_of(start, model, views, poses, points), {options.loss, 60});
  Fit fit;
  fit.camera = with_lens(start, model.distortion, solution.bundle.eyes[0].lens);
  fit.poses = solution.bundle.world_from_board;
  const double count = 2.0 * static_cast<double>(solution.bundle.sights.size());
  const double cost = cost_of(solution.bundle, options.loss);
  fit.rms = std::sqrt(2 * cost / count);
  fit.criterion = criterion_of(cost, count, model);
  const auto sane = [&](double f) { return f > 0.1 * start.width && f < 100.0 * start.width; };
  fit.usable = std::isfinite(fit.criterion) && sane(fit.camera.fx) && sane(fit.camera.fy);
  return fit;
}

/// Share of an 8 x 8 grid over the image that corners fall in.
double coverage_of(const Camera& camera, const std::vector<BoardView>& views) {
  constexpr int kGrid = 8;
  std::set<int> cells;
  for (const BoardView& view : views) {
    for (Eigen::Index i = 0; i < view.pixels.rows(); ++i) {
      const int x = static_cast<int>(kGrid * view.pixels(i, 0) / camera.width);
      const int y = static_cast<int>(kGrid * view.pixels(i, 1) / camera.height);
      cells.insert(y * kGrid + x);
    }
  }
  return static_cast<double>(cells.size()) / (kGrid * kGrid);
}

/// Where corners fall in little of the image, many coefficients explain noise there and bend
/// wildly elsewhere (our choice of the shares).
int max_coefficients(double coverage) {
  return coverage < 0.3 ? 2 : coverage < 0.6 ? 5 : 8;
}

std::vector<BoardView> spread(const std::vector<BoardView>& views, int most) {
  if (static_cast<int>(views.size()) <= most) {
    return views;
  }
  std::vector<BoardView> some;
  for (int i = 0; i < most; ++i) {
    some.push_back(
        views[static_cast<std::size_t>(i) * views.size() / static_cast<std::size_t>(most)]);
  }
  return some;
}

/// Focal lengths to start from, px: the homographies', and those of common lenses where they are
/// silent or wrong.
std::vector<double> starting_focals(const Camera& camera, const std::vector<BoardView>& views,
                                    const BoardPoints& points) {
  std::vector<double> focals = {0.6 * camera.width, 1.0 * camera.width, 2.0 * camera.width};
  const double told = focal_from_homographies(camera, views, points);
  if (told > 0.2 * camera.width && told < 20 * camera.width) {
    focals.insert(focals.begin(), told);
  }
  return focals;
}

/// A fit and the views whose boards it has poses of.
struct StartingFit {
  Fit fit;
  std::vector<BoardView> views;
};

/// Poses and the first distortion coefficient from a focal length; no views where too few have a
/// pose.
StartingFit fit_from_focal(const Camera& camera, double focal, const std::vector<BoardView>& views,
                           const BoardPoints& points, const CalibrateOptions& options) {
  LensNumbers numbers = LensNumbers::Zero();
  numbers.head<4>() << focal, focal, 0.5 * camera.width, 0.5 * camera.height;
  // A board that is tilted the wrong way is a trap: once a lens is known, poses are chosen again.
  Camera lens_now = with_lens(camera, Distortion::None, numbers);
  StartingFit start;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<RigidNumbers> poses;
    std::vector<BoardView> posed;
    for (const BoardView& view : views) {
      const std::vector<BoardPose> some = board_poses(lens_now, view, points);
      if (!some.empty()) {
        poses.push_back(some[0].camera_from_board);
        posed.push_back(view);
      }
    }
    if (static_cast<int>(posed.size()) < options.min_views || posed.size() < start.views.size()) {
      break;
    }
    // One coefficient at once: without it a wide lens drives the focal length off.
    const Fit next =
        fit_model(lens_now, lens_model(LensChoice::Radial1), posed, poses, points, options);
    if (!(next.criterion < start.fit.criterion) && posed.size() == start.views.size()) {
      break;
    }
    start.fit = next;
    start.views = posed;
    lens_now = next.camera;
  }
  return start;
}

/// The fit with the least error of all focal lengths to start from; its criterion is infinite where
/// none fits.
StartingFit best_start(const Camera& camera, const std::vector<BoardView>& views,
                       const BoardPoints& points, const CalibrateOptions& options) {
  constexpr double kGoodStart = 1;  // px: no other is tried
  StartingFit best;
  for (const double focal : starting_focals(camera, views, points)) {
    const StartingFit start = fit_from_focal(camera, focal, views, points, options);
    if (start.views.empty() || start.views.size() < best.views.size()) {
      continue;
    }
    if (start.fit.criterion < best.fit.criterion) {
      best = start;
    }
    if (best.fit.rms < kGoodStart) {
      break;
    }
  }
  return best;
}

/// The fit of the model that options ask for, or of Auto the best one whose distortion does not
/// fold over; its model and what was tried go to `lens`. Not usable where none fits.
Fit choose_model(const StartingFit& start, const BoardPoints& points,
                 const CalibrateOptions& options, SingleLens& lens) {
  Fit chosen;
  bool chosen_folds = true;
  const auto consider = [&](const LensModel& model, const Fit& from_fit) {
    Camera from = from_fit.camera;
    if (model.distortion != from.distortion_model) {
      from.distortion_model = model.distortion;
      from.distortion.fill(0);
    }
    if (model.choice == LensChoice::None) {
      from.distortion.fill(0);
    }
    Fit fit = fit_model(from, model, start.views, from_fit.poses, points, options);
    if (fit.usable) {
      lens.candidates[model.name] = fit.criterion;
      const bool folds = !is_invertible(fit.camera);
      if ((chosen_folds && !folds) || (chosen_folds == folds && fit.criterion < chosen.criterion)) {
        chosen_folds = folds;
        chosen = fit;
        lens.model = model;
      }
    }
    return fit;
  };
  if (options.lens != LensChoice::Auto) {
    consider(lens_model(options.lens), start.fit);
    return chosen;
  }
  Fit before = start.fit;
  const int most = max_coefficients(coverage_of(lens.camera, start.views));
  for (const LensModel& model : lens_models()) {
    if (free_count(model.free) - 4 > most) {
      continue;
    }
    const bool nested = model.distortion == Distortion::Brown;
    const Fit fit = consider(model, nested ? before : start.fit);
    if (nested && fit.usable) {
      before = fit;
    }
  }
  return chosen;
}

/// Error and deviation of the lens that was chosen.
void measure_lens(const std::vector<BoardView>& views, const std::vector<RigidNumbers>& poses,
                  const BoardPoints& points, double loss, SingleLens& lens) {
  const Bundle bundle = bundle_of(lens.camera, lens.model, views, poses, points);
  const auto errors = reprojection_errors(bundle);
  lens.rms = std::sqrt(errors.rowwise().squaredNorm().mean());
  const double sigma =
      std::sqrt(cost_of(bundle, loss) / (2.0 * static_cast<double>(errors.rows())));
  const BundleDeviations deviations = bundle_deviations(bundle, std::max(sigma, 1e-3), {loss, 0});
  lens.focal_deviation = deviations.full_rank ? deviations.lens[0][0] / lens.camera.fx
                                              : std::numeric_limits<double>::infinity();
}

}  // namespace

const std::vector<LensModel>& lens_models() {
  static const std::vector<LensModel> kModels = {
      {LensChoice::None, "none", Distortion::None, mask({})},
      {LensChoice::Radial1, "radial1", Distortion::Brown, mask({0})},
      {LensChoice::Radial2, "radial2", Distortion::Brown, mask({0, 1})},
      {LensChoice::Brown4, "brown4", Distortion::Brown, mask({0, 1, 2, 3})},
      {LensChoice::Brown5, "brown5", Distortion::Brown, mask({0, 1, 2, 3, 4})},
      {LensChoice::Rational, "rational", Distortion::Brown, mask({0, 1, 2, 3, 4, 5, 6, 7})},
      {LensChoice::Fisheye, "fisheye", Distortion::Fisheye, mask({0, 1, 2, 3})}};
  return kModels;
}

const LensModel& lens_model(LensChoice choice) {
  const auto& models = lens_models();
  const auto found = std::find_if(models.begin(), models.end(),
                                  [&](const LensModel& model) { return model.choice == choice; });
  ATELIER_CHECK(found != models.end(), "no model of a lens");
  return *found;
}

SingleLens single_lens(const Camera& camera, const std::vector<BoardView>& all,
                       const BoardOptions& board, const CalibrateOptions& options) {
  SingleLens lens;
  lens.camera = camera;
  const BoardPoints points = board_points(board);
  const std::vector<BoardView> views = spread(all, options.max_views);
  if (static_cast<int>(views.size()) < options.min_views) {
    lens.why_not = std::to_string(views.size()) + " views of the board, of " +
                   std::to_string(options.min_views) + " at least";
    return lens;
  }
  const StartingFit start = best_start(camera, views, points, options);
  if (!std::isfinite(start.fit.criterion)) {
    lens.why_not = "no focal length explains the views";
    return lens;
  }
  const Fit chosen = choose_model(start, points, options, lens);
  if (!chosen.usable) {
    lens.why_not = "no lens explains the views";
    return lens;
  }
  lens.camera = chosen.camera;
  measure_lens(start.views, chosen.poses, points, options.loss, lens);
  // Other cameras may settle what these views leave open: the verdict is the joint adjustment's.
  constexpr double kHopeless = 10;
  if (lens.focal_deviation > kHopeless * options.max_focal_deviation) {
    const std::string by = std::isfinite(lens.focal_deviation)
                               ? "open by " +
                                     std::to_string(saturating_cast<int>(
                                         std::min(999.0, 100 * lens.focal_deviation))) +
                                     "%"
                               : "open";
    lens.why_not = "the views leave the focal length " + by +
                   ": tilt the board by 30 degrees and "
                   "more, in several directions";
    return lens;
  }
  lens.found = true;
  return lens;
}

SingleLens lens_given_boards(const Camera& start, const LensModel& model,
                             const std::vector<BoardView>& views,
                             const std::map<int, RigidNumbers>& world_from_board,
                             const BoardOptions& board, double loss) {
  std::vector<BoardView> placed;
  std::vector<RigidNumbers> poses;
  for (const BoardView& view : views) {
    const auto found = world_from_board.find(view.frame_id);
    if (found != world_from_board.end()) {
      placed.push_back(view);
      poses.push_back(found->second);
    }
  }
  SingleLens best;
  best.camera = start;
  best.model = model;
  const int most = max_coefficients(coverage_of(start, placed));
  double least = std::numeric_limits<double>::infinity();
  for (const LensModel& candidate : lens_models()) {
    const bool mine = candidate.choice == model.choice;
    if (placed.empty() || (free_count(candidate.free) - 4 > most && !mine)) {
      continue;
    }
    Camera from = start;
    if (candidate.distortion != start.distortion_model || candidate.choice == LensChoice::None) {
      from.distortion.fill(0);
    }
    Bundle bundle = bundle_of(from, candidate, placed, poses, board_points(board));
    bundle.fixed_boards = true;
    bundle.eyes[0].fixed_pose = false;
    bundle.eyes[0].camera_from_world =
        rigid_of(start.camera_from_world_rotation, start.camera_from_world_translation);
    bundle = solve_bundle(bundle, {loss, 60}).bundle;
    const Camera camera = with_lens(from, candidate.distortion, bundle.eyes[0].lens);
    const double criterion = criterion_of(
        cost_of(bundle, loss), 2.0 * static_cast<double>(bundle.sights.size()), candidate);
    const bool sane = camera.fx > 0.1 * camera.width && camera.fx < 100.0 * camera.width;
    if (std::isfinite(criterion) && sane && (mine || is_invertible(camera))) {
      best.candidates[candidate.name] = criterion;
      if (criterion < least) {
        least = criterion;
        best.found = true;
        best.model = candidate;
        best.camera = camera;
        best.camera.camera_from_world_rotation = rotation_of(bundle.eyes[0].camera_from_world);
        best.camera.camera_from_world_translation = bundle.eyes[0].camera_from_world.tail<3>();
      }
    }
  }
  return best;
}

}  // namespace atelier
