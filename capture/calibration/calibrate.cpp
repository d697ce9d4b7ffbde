#include "capture/calibration/calibrate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "capture/calibration/board_pose.h"
#include "capture/calibration/bundle.h"
#include "capture/calibration/chain_poses.h"
#include "capture/calibration/single_lens.h"
#include "core/error.h"

namespace atelier {
namespace {

using BoardPoints = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

void check_views(const std::vector<RigCamera>& rig, const std::vector<BoardView>& views,
                 const BoardPoints& points) {
  for (const BoardView& view : views) {
    ATELIER_CHECK(view.camera_idx >= 0 && view.camera_idx < static_cast<int>(rig.size()),
                  "a view of a camera that is not there");
    ATELIER_CHECK(static_cast<Eigen::Index>(view.ids.size()) == view.pixels.rows(),
                  "as many numbers as pixels");
    for (const int id : view.ids) {
      ATELIER_CHECK(id >= 0 && id < points.rows(), "a corner that the board does not have");
    }
  }
}

Finding error_of(std::string code, const std::string& camera, std::string what,
                 std::string advice) {
  return {Severity::Error, "calibration-" + std::move(code), camera, std::move(what),
          std::move(advice)};
}

/// Lenses of all cameras, each by itself; true where there is one.
std::vector<bool> find_lenses(const std::vector<RigCamera>& rig,
                              const std::vector<BoardView>& views, const BoardOptions& board,
                              const CalibrateOptions& options, Calibration& result,
                              std::vector<LensModel>& models) {
  std::vector<bool> has_lens(rig.size(), false);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const std::string& id = rig[c].camera.id;
    CameraQuality& quality = result.quality[c];
    std::vector<BoardView> own;
    for (const BoardView& view : views) {
      if (view.camera_idx == static_cast<int>(c)) {
        own.push_back(view);
      }
    }
    quality.views_seen = static_cast<int>(own.size());
    if (rig[c].known_lens) {
      has_lens[c] = !own.empty();
      quality.lens = "known";
      models[c].distortion = rig[c].camera.distortion_model;
      if (own.empty()) {
        result.findings.push_back(error_of("no-board", id, "no picture shows the board",
                                           "carry it where this camera sees it"));
      }
      continue;
    }
    if (own.empty()) {
      result.findings.push_back(
          error_of("no-board", id, "no picture shows the board",
                   "check the board's kind, its numbers of squares and its dictionary"));
      continue;
    }
    const SingleLens lens = single_lens(rig[c].camera, own, board, options);
    quality.candidates = lens.candidates;
    if (!lens.found) {
      const bool few = static_cast<int>(own.size()) < options.least_views;
      result.findings.push_back(error_of(few ? "few-views" : "focal-open", id, lens.why_not,
                                         few ? "show it the board more often, or give its lens by "
                                               "--lenses"
                                             : "show it the board from more sides, or give its "
                                               "lens by --lenses"));
      continue;
    }
    has_lens[c] = true;
    result.cameras[c] = lens.camera;
    models[c] = lens.model;
    quality.lens = lens.model.name;
  }
  return has_lens;
}

/// One round of bundle adjustment and what its residuals are.
struct Round {
  Bundle bundle;
  std::map<int, int> board_of_frame;
  std::vector<double> errors;  ///< of each sight, px
  bool converged = false;
};

/// The bundle of everything but the views that are left out.
Round round_of(const std::vector<RigCamera>& rig, const std::vector<Camera>& cameras,
               const std::vector<LensModel>& models, const PoseChain& chain, std::size_t fixed,
               const std::vector<PosedView>& posed, const std::set<std::pair<int, int>>& out,
               const BoardPoints& points) {
  Round round;
  round.bundle.points = points;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    Bundle::Eye eye;
    eye.model = models[c].distortion;
    eye.lens = lens_of(cameras[c]);
    eye.free = models[c].free;
    eye.camera_from_world = chain.camera_from_world[c];
    eye.fixed_pose = c == fixed;
    eye.centre = {0.5 * rig[c].camera.width, 0.5 * rig[c].camera.height};
    eye.centre_prior = 0.1 * rig[c].camera.width;
    round.bundle.eyes.push_back(eye);
  }
  for (const auto& [frame, pose] : chain.world_from_board) {
    round.board_of_frame[frame] = static_cast<int>(round.bundle.world_from_board.size());
    round.bundle.world_from_board.push_back(pose);
  }
  for (const PosedView& view : posed) {
    const int c = view.view.camera_idx;
    if (!chain.in_rig[static_cast<std::size_t>(c)] || out.contains({c, view.view.frame_id})) {
      continue;
    }
    for (std::size_t i = 0; i < view.view.ids.size(); ++i) {
      round.bundle.sights.push_back(
          {c, round.board_of_frame.at(view.view.frame_id), view.view.ids[i],
           view.view.pixels.row(static_cast<Eigen::Index>(i)).transpose()});
    }
  }
  return round;
}

/// Pixel error of every view of the rig under its present poses, by camera and frame.
std::map<std::pair<int, int>, double> errors_of_views(const std::vector<Camera>& cameras,
                                                      const PoseChain& chain,
                                                      const std::vector<PosedView>& posed,
                                                      const BoardPoints& points) {
  std::map<std::pair<int, int>, double> errors;
  for (const PosedView& view : posed) {
    const auto c = static_cast<std::size_t>(view.view.camera_idx);
    const auto board = chain.world_from_board.find(view.view.frame_id);
    if (chain.in_rig[c] && board != chain.world_from_board.end()) {
      errors[{view.view.camera_idx, view.view.frame_id}] =
          std::min(1e6, pose_rms(cameras[c], view.view, points,
                                 chained(chain.camera_from_world[c], board->second)));
    }
  }
  return errors;
}

Camera posed_camera(Camera camera, const PoseChain& chain, std::size_t c) {
  camera.camera_from_world_rotation = rotation_of(chain.camera_from_world[c]);
  camera.camera_from_world_translation = chain.camera_from_world[c].tail<3>();
  return camera;
}

double cauchy_sigma(const std::vector<double>& errors, std::size_t unknowns, double loss) {
  double sum = 0;
  for (const double error : errors) {
    sum += loss > 0 ? loss * loss * std::log1p(error * error / (loss * loss)) : error * error;
  }
  const double freedom = 2.0 * static_cast<double>(errors.size()) - static_cast<double>(unknowns);
  return std::sqrt(sum / std::max(freedom, 1.0));
}

}  // namespace

OptionTable describe(CalibrateOptions& options) {
  OptionTable table;
  table.add("lens", options.lens,
            {{"auto", LensChoice::Auto},
             {"none", LensChoice::None},
             {"radial1", LensChoice::Radial1},
             {"radial2", LensChoice::Radial2},
             {"brown4", LensChoice::Brown4},
             {"brown5", LensChoice::Brown5},
             {"rational", LensChoice::Rational},
             {"fisheye", LensChoice::Fisheye}},
            "Lens distortion model; auto: chosen for each camera by what its views support");
  table.add("loss", options.loss, 1e-3, 100, "px",
            "Reprojection error beyond which a corner is down-weighted as an outlier");
  table.add("reject", options.reject, 1.5, 1000, "",
            "Ratio to the median error of views beyond which a view is rejected");
  table.add("least_rejected", options.least_rejected, 0, 1000, "px",
            "Minimum error of a view that is rejected, whatever the others are");
  table.add("least_views", options.least_views, 3, 1000, "",
            "Minimum number of views of the board for a lens to be calibrated");
  table.add("most_views", options.most_views, 4, 100000, "",
            "Maximum number of views for the initial estimate of a lens; more take longer, and all "
            "count in the final one");
  table.add("largest_deviation", options.largest_deviation, 1e-4, 1, "",
            "Maximum relative standard deviation of a focal length that counts as determined");
  return table;
}

double root_mean_square(const std::vector<double>& lengths) {
  double sum = 0;
  for (const double length : lengths) {
    sum += length * length;
  }
  return lengths.empty() ? 0 : std::sqrt(sum / static_cast<double>(lengths.size()));
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) {
    return 0;
  }
  const auto at = static_cast<std::ptrdiff_t>(
      std::min<double>(static_cast<double>(values.size()) - 1,
                       std::floor(share * static_cast<double>(values.size()))));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

Calibration calibrate(const std::vector<RigCamera>& rig, const std::vector<BoardView>& views,
                      const BoardOptions& board, const CalibrateOptions& options) {
  const BoardPoints points = board_points(board);
  check_views(rig, views, points);
  if (rig.size() > 1 && is_symmetric(board)) {
    throw DataError("", "board",
                    std::to_string(board.columns) + " x " + std::to_string(board.rows) +
                        " squares, which look the same upside down",
                    "for several cameras, a board with an odd and an even number of squares, or "
                    "ChArUco");
  }
  Calibration result;
  for (const RigCamera& camera : rig) {
    result.cameras.push_back(camera.camera);
  }
  result.quality.resize(rig.size());
  std::vector<LensModel> models(rig.size());
  const std::vector<bool> has_lens = find_lenses(rig, views, board, options, result, models);
  if (std::none_of(has_lens.begin(), has_lens.end(), [](bool has) { return has; })) {
    throw DataError("", result.findings.empty() ? "" : result.findings.front().place,
                    result.findings.empty() ? "no cameras" : result.findings.front().what,
                    result.findings.empty() ? "some" : result.findings.front().advice);
  }

  std::vector<PosedView> posed;
  for (const BoardView& view : views) {
    const auto c = static_cast<std::size_t>(view.camera_idx);
    if (!has_lens[c]) {
      continue;
    }
    PosedView one{view, board_poses(result.cameras[c], view, points)};
    if (one.poses.empty()) {
      result.rejected.push_back({result.cameras[c].id, view.frame_id, "no pose of the board fits"});
    } else {
      posed.push_back(std::move(one));
    }
  }
  PoseChain chain = chain_poses(result.cameras, posed, points);
  const bool alone = rig.size() == 1;
  if (alone) {
    chain.in_rig = {true};
    for (const PosedView& view : posed) {
      chain.world_from_board[view.view.frame_id] = view.poses[0].camera_from_board;
    }
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    result.quality[c].in_rig = chain.in_rig[c];
    if (has_lens[c] && !chain.in_rig[c]) {
      result.findings.push_back(error_of(
          "unconnected", rig[c].camera.id, "it shares no view of the board with the others",
          "carry the board where this camera and another see it at once; its lens is "
          "calibrated, its pose is not"));
    }
  }
  if (std::none_of(chain.in_rig.begin(), chain.in_rig.end(), [](bool in) { return in; })) {
    throw DataError("", "cameras", "no two of them see the board at the same instant",
                    "pictures of one instant under one frame number in every camera");
  }

  const auto fixed = static_cast<std::size_t>(
      std::find(chain.in_rig.begin(), chain.in_rig.end(), true) - chain.in_rig.begin());
  // The first camera of the group is the world.
  const RigidNumbers first_from_world = chain.camera_from_world[fixed];
  for (std::size_t c = 0; c < rig.size(); ++c) {
    chain.camera_from_world[c] = chained(chain.camera_from_world[c], inverse_of(first_from_world));
  }
  for (auto& [frame, pose] : chain.world_from_board) {
    pose = chained(first_from_world, pose);
  }

  double allowed = 0;
  std::set<std::pair<int, int>> out;  // camera, frame
  Round round;
  double loss = options.loss;
  constexpr int kRounds = 5;
  for (int turn = 0; turn < kRounds; ++turn) {
    round = round_of(rig, result.cameras, models, chain, fixed, posed, out, points);
    // A start far off needs a loss that still pulls.
    if (turn == 0) {
      round.bundle = solve_bundle(round.bundle, {10 * options.loss, 50}).bundle;
    }
    const BundleSolution solution = solve_bundle(round.bundle, {loss, 200});
    round.bundle = solution.bundle;
    round.converged = solution.converged;
    const auto errors = reprojection_errors(round.bundle);
    round.errors.clear();
    for (Eigen::Index i = 0; i < errors.rows(); ++i) {
      const double error = errors.row(i).norm();
      round.errors.push_back(std::isfinite(error) ? error : 1e6);
    }
    for (std::size_t c = 0; c < rig.size(); ++c) {
      chain.camera_from_world[c] = round.bundle.eyes[c].camera_from_world;
      result.cameras[c] =
          with_lens(result.cameras[c], models[c].distortion, round.bundle.eyes[c].lens);
    }
    for (const auto& [frame, board_idx] : round.board_of_frame) {
      chain.world_from_board[frame] =
          round.bundle.world_from_board[static_cast<std::size_t>(board_idx)];
    }
    if (turn + 1 == kRounds) {
      break;
    }
    bool changed = false;
    if (turn == 0 && options.lens == LensChoice::Auto && !alone) {
      for (std::size_t c = 0; c < rig.size(); ++c) {
        if (rig[c].known_lens || !chain.in_rig[c]) {
          continue;
        }
        std::vector<BoardView> own;
        for (const PosedView& view : posed) {
          if (view.view.camera_idx == static_cast<int>(c)) {
            own.push_back(view.view);
          }
        }
        const SingleLens lens =
            lens_given_boards(posed_camera(result.cameras[c], chain, c), models[c], own,
                              chain.world_from_board, board, loss);
        if (lens.found && lens.model.choice != models[c].choice) {
          models[c] = lens.model;
          result.quality[c].lens = lens.model.name;
          result.cameras[c] = lens.camera;
          chain.camera_from_world[c] = rigid_of(lens.camera.camera_from_world_rotation,
                                                lens.camera.camera_from_world_translation);
          changed = true;
        }
        result.quality[c].candidates = lens.candidates;
      }
    }
    // Cauchy's loss loses little where its width is 2.4 deviations (Holland and Welsch 1977); the
    // median of lengths in the plane is 1.18 deviations.
    const double wide = std::max(options.loss, 2.4 / 1.18 * percentile(round.errors, 0.5));
    changed = changed || std::abs(wide - loss) > 0.1 * loss;
    loss = wide;
    const std::map<std::pair<int, int>, double> view_errors =
        errors_of_views(result.cameras, chain, posed, points);
    std::vector<double> sorted;
    for (const auto& [view, error] : view_errors) {
      sorted.push_back(error);
    }
    allowed = std::max(options.least_rejected, options.reject * percentile(sorted, 0.5));
    std::set<std::pair<int, int>> bad;
    for (const auto& [view, error] : view_errors) {
      if (error > allowed) {
        bad.insert(view);
      }
    }
    changed = changed || bad != out;
    out = bad;
    if (!changed) {
      break;
    }
  }
  for (const auto& [view, error] : errors_of_views(result.cameras, chain, posed, points)) {
    if (out.contains(view)) {
      char text[160];
      std::snprintf(text, sizeof text,
                    "its corners are %.2f px (rms) from where the others put the board, of %.2f "
                    "that are allowed",
                    error, allowed);
      result.rejected.push_back(
          {result.cameras[static_cast<std::size_t>(view.first)].id, view.second, text});
    }
  }
  result.loss = loss;

  result.converged = round.converged;
  result.rms = root_mean_square(round.errors);
  result.p95 = percentile(round.errors, 0.95);
  std::size_t unknowns = 0;
  std::set<int> boards;
  std::vector<bool> used(rig.size(), false);
  for (const Bundle::Sight& sight : round.bundle.sights) {
    boards.insert(sight.board);
    used[static_cast<std::size_t>(sight.eye)] = true;
  }
  unknowns = 6 * boards.size();
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (used[c]) {
      unknowns += static_cast<std::size_t>(
          std::count(models[c].free.begin(), models[c].free.end(), true) + (c == fixed ? 0 : 6));
    }
  }
  result.sigma = cauchy_sigma(round.errors, unknowns, loss);
  const BundleDeviations deviations = bundle_deviations(round.bundle, result.sigma, {loss, 0});
  if (!deviations.full_rank) {
    result.findings.push_back({Severity::Warning, "calibration-open", "",
                               "the views leave a number open, so that no deviations are known",
                               "show the board in more places and tilts"});
  }
  constexpr int kGrid = 8;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    CameraQuality& quality = result.quality[c];
    if (!chain.in_rig[c]) {
      continue;
    }
    result.cameras[c] = posed_camera(result.cameras[c], chain, c);
    const Camera& camera = result.cameras[c];
    std::vector<double> errors;
    std::set<int> cells;
    std::set<int> frames;
    for (std::size_t i = 0; i < round.bundle.sights.size(); ++i) {
      const Bundle::Sight& sight = round.bundle.sights[i];
      if (sight.eye != static_cast<int>(c)) {
        continue;
      }
      errors.push_back(round.errors[i]);
      frames.insert(sight.board);
      const int x =
          std::clamp(static_cast<int>(kGrid * sight.pixel.x() / camera.width), 0, kGrid - 1);
      const int y =
          std::clamp(static_cast<int>(kGrid * sight.pixel.y() / camera.height), 0, kGrid - 1);
      cells.insert(y * kGrid + x);
    }
    quality.views_used = static_cast<int>(frames.size());
    quality.corners = static_cast<int>(errors.size());
    quality.rms = root_mean_square(errors);
    quality.p95 = percentile(errors, 0.95);
    quality.coverage = static_cast<double>(cells.size()) / (kGrid * kGrid);
    quality.lens_deviation = deviations.lens[c];
    const Eigen::Matrix<double, 6, 6>& covariance = deviations.pose_covariance[c];
    quality.rotation_deviation = covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt();
    // Centre -R't: its derivative by the six numbers, by central differences.
    Eigen::Matrix<double, 3, 6> by_pose;
    for (int i = 0; i < 6; ++i) {
      constexpr double kStep = 1e-6;
      RigidNumbers plus = chain.camera_from_world[c];
      RigidNumbers minus = plus;
      plus[i] += kStep;
      minus[i] -= kStep;
      by_pose.col(i) = (inverse_of(plus).tail<3>() - inverse_of(minus).tail<3>()) / (2 * kStep);
    }
    quality.centre_deviation =
        (by_pose * covariance * by_pose.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
    const double open = quality.lens_deviation[0] / camera.fx;
    if (!rig[c].known_lens && open > options.largest_deviation) {
      result.findings.push_back(
          error_of("focal-open", camera.id,
                   "the views leave its focal length open by " +
                       std::to_string(static_cast<int>(std::lround(100 * open))) + "%",
                   "show it the board from more sides, tilted by 30 degrees and more, or give its "
                   "lens by --lenses"));
    }
    if (!rig[c].known_lens && quality.coverage < 0.3) {
      result.findings.push_back({Severity::Warning, "calibration-coverage", camera.id,
                                 "corners fall in " +
                                     std::to_string(static_cast<int>(100 * quality.coverage)) +
                                     "% of the picture's cells",
                                 "show the board near the borders and corners of the picture too"});
    }
    if (!rig[c].known_lens && !is_invertible(camera)) {
      result.findings.push_back({Severity::Warning, "calibration-lens-folds", camera.id,
                                 "its distortion folds over within the picture",
                                 "take a simpler --calibration.lens, or show the board near the "
                                 "borders"});
    }
  }
  for (const auto& [frame, board_idx] : round.board_of_frame) {
    if (boards.contains(board_idx)) {
      result.world_from_board[frame] = chain.world_from_board.at(frame);
    }
  }
  if (!result.converged) {
    result.findings.push_back({Severity::Warning, "calibration-converged", "",
                               "the adjustment did not come to an end",
                               "look at the rejected views; show the board in more places"});
  }
  if (result.rms > 2) {
    result.findings.push_back(
        {Severity::Warning, "calibration-residual", "",
         "corners are " + std::to_string(result.rms) + " px (rms) off",
         "check that the board is flat and its squares are as said, that cameras are in step and "
         "stand still"});
  }
  return result;
}

std::vector<double> board_errors(const std::vector<Camera>& cameras,
                                 const std::vector<BoardView>& views, const BoardOptions& board) {
  const BoardPoints points = board_points(board);
  Bundle bundle;
  bundle.points = points;
  for (const Camera& camera : cameras) {
    Bundle::Eye eye;
    eye.model = camera.distortion_model;
    eye.lens = lens_of(camera);
    eye.camera_from_world =
        rigid_of(camera.camera_from_world_rotation, camera.camera_from_world_translation);
    eye.fixed_pose = true;
    bundle.eyes.push_back(eye);
  }
  std::map<int, int> board_of_frame;
  std::map<int, double> least;
  const auto rms_of = [&](int frame, const RigidNumbers& world_from_board) {
    double sum = 0;
    for (const BoardView& view : views) {
      if (view.frame_id == frame) {
        const auto c = static_cast<std::size_t>(view.camera_idx);
        sum += std::pow(pose_rms(cameras[c], view, points,
                                 chained(bundle.eyes[c].camera_from_world, world_from_board)),
                        2);
      }
    }
    return sum;
  };
  for (const BoardView& view : views) {
    const auto c = static_cast<std::size_t>(view.camera_idx);
    for (const BoardPose& pose : board_poses(cameras[c], view, points)) {
      const RigidNumbers world_from_board =
          chained(inverse_of(bundle.eyes[c].camera_from_world), pose.camera_from_board);
      const double rms = rms_of(view.frame_id, world_from_board);
      if (!board_of_frame.contains(view.frame_id)) {
        board_of_frame[view.frame_id] = static_cast<int>(bundle.world_from_board.size());
        bundle.world_from_board.push_back(world_from_board);
        least[view.frame_id] = rms;
      } else if (rms < least[view.frame_id]) {
        bundle.world_from_board[static_cast<std::size_t>(board_of_frame[view.frame_id])] =
            world_from_board;
        least[view.frame_id] = rms;
      }
    }
  }
  for (const BoardView& view : views) {
    if (!board_of_frame.contains(view.frame_id)) {
      continue;
    }
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      bundle.sights.push_back({view.camera_idx, board_of_frame[view.frame_id], view.ids[i],
                               view.pixels.row(static_cast<Eigen::Index>(i)).transpose()});
    }
  }
  const auto errors = reprojection_errors(solve_bundle(bundle, {0, 100}).bundle);
  std::vector<double> lengths;
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    lengths.push_back(errors.row(i).norm());
  }
  return lengths;
}

}  // namespace atelier
