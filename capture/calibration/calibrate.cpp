#include "capture/calibration/calibrate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "capture/calibration/adjust_rig.h"
#include "capture/calibration/board_pose.h"
#include "capture/calibration/bundle.h"
#include "capture/calibration/chain_poses.h"
#include "capture/calibration/single_lens.h"
#include "core/error.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// Throws LogicError for views that cannot be, DataError for a board that leaves poses open.
void check_views(const std::vector<RigCamera>& rig, const std::vector<BoardView>& views,
                 const BoardOptions& board, const BoardPoints& points) {
  for (const BoardView& view : views) {
    ATELIER_CHECK(view.camera_idx >= 0 && view.camera_idx < static_cast<int>(rig.size()),
                  "a view of a camera that is not there");
    ATELIER_CHECK(static_cast<Eigen::Index>(view.ids.size()) == view.pixels.rows(),
                  "as many numbers as pixels");
    for (const int id : view.ids) {
      ATELIER_CHECK(id >= 0 && id < points.rows(), "a corner that the board does not have");
    }
  }
  if (rig.size() > 1 && is_symmetric(board)) {
    throw DataError("", "board",
                    std::to_string(board.columns) + " x " + std::to_string(board.rows) +
                        " squares, which look the same upside down",
                    "for several cameras, a board with an odd and an even number of squares, or "
                    "ChArUco");
  }
}

constexpr const char* kOneInstant =
    "images of one instant under one frame number in every camera; lenses alone are found by "
    "--calibration.poses=false";

Finding error_of(std::string code, const std::string& camera, std::string what,
                 std::string advice) {
  return {Severity::Error, "calibration-" + std::move(code), camera, std::move(what),
          std::move(advice)};
}

/// Lenses of all cameras, each by itself; true where there is one. Throws DataError if no camera
/// has one.
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
        result.findings.push_back(error_of("no-board", id, "no image shows the board",
                                           "carry it where this camera sees it"));
      }
      continue;
    }
    if (own.empty()) {
      result.findings.push_back(
          error_of("no-board", id, "no image shows the board",
                   "check the board's kind, its numbers of squares and its dictionary"));
      continue;
    }
    const SingleLens lens = single_lens(rig[c].camera, own, board, options);
    quality.candidates = lens.candidates;
    if (!lens.found) {
      const bool few = static_cast<int>(own.size()) < options.min_views;
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
  if (std::none_of(has_lens.begin(), has_lens.end(), [](bool has) { return has; })) {
    throw DataError("", result.findings.empty() ? "" : result.findings.front().place,
                    result.findings.empty() ? "no cameras" : result.findings.front().what,
                    result.findings.empty() ? "some" : result.findings.front().advice);
  }
  return has_lens;
}

/// The poses that the board can have in every view of a camera with a lens; views without any are
/// rejected.
std::vector<PosedView> pose_views(const std::vector<BoardView>& views,
                                  const std::vector<bool>& has_lens, const BoardPoints& points,
                                  Calibration& result) {
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
  return posed;
}

/// The chain of a single camera, which needs no other to be in the rig.
void place_single_camera(const std::vector<PosedView>& posed, PoseChain& chain) {
  chain.in_rig = {true};
  for (const PosedView& view : posed) {
    chain.world_from_board[view.view.frame_id] = view.poses[0].camera_from_board;
  }
}

/// Says which cameras are in the rig. Throws DataError if none is.
void note_connections(const std::vector<RigCamera>& rig, const std::vector<bool>& has_lens,
                      const PoseChain& chain, Calibration& result) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    result.quality[c].in_rig = chain.in_rig[c];
    const bool out_of_step = std::any_of(chain.out_of_step[c].begin(), chain.out_of_step[c].end(),
                                         [](int frames) { return frames > 0; });
    if (has_lens[c] && !chain.in_rig[c]) {
      result.findings.push_back(error_of(
          "unconnected", rig[c].camera.id,
          out_of_step ? "no two of its views put the other cameras in the same place"
                      : "it shares no view of the board with the others",
          out_of_step ? kOneInstant
                      : "carry the board where this camera and another see it at once; its lens "
                        "is calibrated, its pose is not"));
    }
  }
  if (std::none_of(chain.in_rig.begin(), chain.in_rig.end(), [](bool in) { return in; })) {
    const bool out_of_step = std::any_of(
        chain.out_of_step.begin(), chain.out_of_step.end(), [](const std::vector<int>& frames) {
          return std::any_of(frames.begin(), frames.end(), [](int count) { return count > 0; });
        });
    throw DataError("", "cameras",
                    out_of_step
                        ? "images of one number put the cameras somewhere else in every view"
                        : "no two of them see the board at the same instant",
                    kOneInstant);
  }
}

/// Moves the world into the frame of a camera.
void make_world(std::size_t camera_idx, PoseChain& chain) {
  const RigidNumbers camera_from_world = chain.camera_from_world[camera_idx];
  for (RigidNumbers& pose : chain.camera_from_world) {
    pose = chained(pose, inverse_of(camera_from_world));
  }
  for (auto& [frame, pose] : chain.world_from_board) {
    pose = chained(camera_from_world, pose);
  }
}

void report_misfits(const std::vector<PosedView>& posed, const BoardPoints& points,
                    const RigAdjustment& state, Calibration& result) {
  for (const auto& [view, error] : errors_of_views(result.cameras, state.chain, posed, points)) {
    if (state.left_out.contains(view)) {
      char text[160];
      std::snprintf(text, sizeof text,
                    "its corners are %.2f px (rms) from where the others put the board, of %.2f "
                    "that are allowed",
                    error, state.allowed);
      result.rejected.push_back(
          {result.cameras[static_cast<std::size_t>(view.first)].id, view.second, text});
    }
  }
}

double cauchy_sigma(const std::vector<double>& errors, std::size_t unknowns, double loss) {
  double sum = 0;
  for (const double error : errors) {
    sum += loss > 0 ? loss * loss * std::log1p(error * error / (loss * loss)) : error * error;
  }
  const double freedom = 2.0 * static_cast<double>(errors.size()) - static_cast<double>(unknowns);
  return std::sqrt(sum / std::max(freedom, 1.0));
}

/// The boards that some corner in use lies on.
std::set<int> boards_in_use(const Bundle& bundle) {
  std::set<int> boards;
  for (const Bundle::Sight& sight : bundle.sights) {
    boards.insert(sight.board);
  }
  return boards;
}

/// How many numbers the last round of adjustment was free to choose.
std::size_t unknowns_of(const RigAdjustment& state) {
  std::vector<bool> used(state.models.size(), false);
  for (const Bundle::Sight& sight : state.round.bundle.sights) {
    used[static_cast<std::size_t>(sight.eye)] = true;
  }
  std::size_t unknowns = 6 * boards_in_use(state.round.bundle).size();
  for (std::size_t c = 0; c < used.size(); ++c) {
    if (used[c]) {
      const LensMask& free = state.models[c].free;
      unknowns += static_cast<std::size_t>(std::count(free.begin(), free.end(), true) +
                                           (c == state.fixed ? 0 : 6));
    }
  }
  return unknowns;
}

/// Errors and coverage of the corners that a camera sees.
void measure_corners(const AdjustmentRound& round, std::size_t c, const Camera& camera,
                     CameraQuality& quality) {
  constexpr int kGrid = 8;
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
        std::clamp(saturating_cast<int>(kGrid * sight.pixel.x() / camera.width), 0, kGrid - 1);
    const int y =
        std::clamp(saturating_cast<int>(kGrid * sight.pixel.y() / camera.height), 0, kGrid - 1);
    cells.insert(y * kGrid + x);
  }
  quality.views_used = static_cast<int>(frames.size());
  quality.corners = static_cast<int>(errors.size());
  quality.rms = root_mean_square(errors);
  quality.p95 = percentile(errors, 0.95);
  quality.coverage = static_cast<double>(cells.size()) / (kGrid * kGrid);
}

/// Findings on a lens that was calibrated.
void judge_lens(const Camera& camera, const CameraQuality& quality, const CalibrateOptions& options,
                std::vector<Finding>& findings) {
  const double open = quality.lens_deviation[0] / camera.fx;
  if (open > options.max_focal_deviation) {
    findings.push_back(error_of(
        "focal-open", camera.id, "the views leave its focal length open by " + percent(open),
        "show it the board from more sides, tilted by 30 degrees and more, or give its "
        "lens by --lenses"));
  }
  if (quality.coverage < 0.3) {
    findings.push_back({Severity::Warning, "calibration-coverage", camera.id,
                        "corners fall in " + percent(quality.coverage) + " of the image's cells",
                        "show the board near the borders and corners of the image too"});
  }
  if (!is_invertible(camera)) {
    findings.push_back({Severity::Warning, "calibration-lens-folds", camera.id,
                        "its distortion folds over within the image",
                        "take a simpler --calibration.lens, or show the board near the "
                        "borders"});
  }
}

/// Poses and quality of the cameras of the rig, by the last round of adjustment.
void judge_cameras(const std::vector<RigCamera>& rig, const RigAdjustment& state,
                   const CalibrateOptions& options, Calibration& result) {
  const BundleDeviations deviations =
      bundle_deviations(state.round.bundle, result.sigma, {state.loss, 0});
  if (!deviations.full_rank) {
    result.findings.push_back({Severity::Warning, "calibration-open", "",
                               "the views leave a number open, so that no deviations are known",
                               "show the board in more places and tilts"});
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (!state.chain.in_rig[c]) {
      continue;
    }
    CameraQuality& quality = result.quality[c];
    result.cameras[c] = posed_camera(result.cameras[c], state.chain, c);
    measure_corners(state.round, c, result.cameras[c], quality);
    quality.lens_deviation = deviations.lens[c];
    const Eigen::Matrix<double, 6, 6>& covariance = deviations.pose_covariance[c];
    quality.rotation_deviation = covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt();
    quality.centre_deviation = centre_deviation(state.chain.camera_from_world[c], covariance);
    if (!rig[c].known_lens) {
      judge_lens(result.cameras[c], quality, options, result.findings);
    }
  }
}

/// Each camera by itself, at the origin.
Calibration calibrate_lenses(const std::vector<RigCamera>& rig, const std::vector<BoardView>& views,
                             const BoardOptions& board, const CalibrateOptions& options) {
  Calibration all;
  all.converged = true;
  std::vector<double> squares;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    std::vector<BoardView> own;
    for (BoardView view : views) {
      if (view.camera_idx == static_cast<int>(c)) {
        view.camera_idx = 0;
        own.push_back(std::move(view));
      }
    }
    Calibration one;
    try {
      one = calibrate({rig[c]}, own, board, options);
    } catch (const DataError& error) {
      one.cameras = {rig[c].camera};
      one.quality.resize(1);
      one.quality[0].views_seen = static_cast<int>(own.size());
      one.converged = true;
      one.findings.push_back(error_of("no-lens", rig[c].camera.id, error.found, error.expected));
    }
    one.cameras[0].camera_from_world_rotation.setIdentity();
    one.cameras[0].camera_from_world_translation.setZero();
    all.cameras.push_back(one.cameras[0]);
    all.quality.push_back(one.quality[0]);
    all.rejected.insert(all.rejected.end(), one.rejected.begin(), one.rejected.end());
    all.findings.insert(all.findings.end(), one.findings.begin(), one.findings.end());
    all.converged = all.converged && one.converged;
    all.p95 = std::max(all.p95, one.p95);
    all.loss = std::max(all.loss, one.loss);
    all.sigma = std::max(all.sigma, one.sigma);
    squares.insert(squares.end(), static_cast<std::size_t>(one.quality[0].corners), one.rms);
  }
  all.rms = root_mean_square(squares);
  all.lenses_alone = true;
  return all;
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
  table.add("min_rejected", options.min_rejected, 0, 1000, "px",
            "Minimum error of a view that is rejected, whatever the others are");
  table.add("min_views", options.min_views, 3, 1000, "",
            "Minimum number of views of the board for a lens to be calibrated");
  table.add("max_views", options.max_views, 4, 100000, "",
            "Maximum number of views for the initial estimate of a lens; more take longer, and all "
            "count in the final one");
  table.add("poses", options.poses,
            "Poses of the cameras as well as their lenses; without, images of one number need not "
            "be of one instant");
  table.add("max_focal_deviation", options.max_focal_deviation, 1e-4, 1, "",
            "Maximum relative standard deviation of a focal length that counts as determined");
  return table;
}

void judge_adjustment(Calibration& result) {
  if (!result.converged) {
    result.findings.push_back({Severity::Warning, "calibration-converged", "",
                               "the adjustment did not come to an end",
                               "look at the rejected views; show the board in more places"});
  }
  // Detectors of joints are off by some pixels where detectors of corners are by tenths.
  if (result.rms > (result.points > 0 ? 12 : 2)) {
    result.findings.push_back(
        {Severity::Warning, "calibration-residual", "",
         (result.points > 0 ? "keypoints are " : "corners are ") + short_number(result.rms, 3) +
             " px (rms) off",
         result.points > 0
             ? "check that cameras are in step and stand still, and that the lenses are theirs"
             : "check that the board is flat and its squares are as said, that cameras are in "
               "step and stand still"});
  }
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
  const auto at = saturating_cast<std::ptrdiff_t>(
      std::min<double>(static_cast<double>(values.size()) - 1,
                       std::floor(share * static_cast<double>(values.size()))));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

Calibration calibrate(const std::vector<RigCamera>& rig, const std::vector<BoardView>& views,
                      const BoardOptions& board, const CalibrateOptions& options) {
  if (!options.poses && rig.size() > 1) {
    return calibrate_lenses(rig, views, board, options);
  }
  const BoardPoints points = board_points(board);
  check_views(rig, views, board, points);
  Calibration result;
  for (const RigCamera& camera : rig) {
    result.cameras.push_back(camera.camera);
  }
  result.quality.resize(rig.size());
  RigAdjustment state;
  state.models.resize(rig.size());
  state.loss = options.loss;
  const std::vector<bool> has_lens = find_lenses(rig, views, board, options, result, state.models);
  const std::vector<PosedView> posed = pose_views(views, has_lens, points, result);
  state.chain = chain_poses(result.cameras, posed, points);
  PoseChain& chain = state.chain;
  if (rig.size() == 1) {
    place_single_camera(posed, chain);
  }
  note_connections(rig, has_lens, chain, result);
  // The first camera of the group is the world.
  state.fixed = static_cast<std::size_t>(std::find(chain.in_rig.begin(), chain.in_rig.end(), true) -
                                         chain.in_rig.begin());
  make_world(state.fixed, chain);
  adjust_until_settled(rig, posed, board, options, state, result);
  report_misfits(posed, points, state, result);

  const AdjustmentRound& round = state.round;
  result.loss = state.loss;
  result.converged = round.converged;
  result.rms = root_mean_square(round.errors);
  result.p95 = percentile(round.errors, 0.95);
  result.sigma = cauchy_sigma(round.errors, unknowns_of(state), state.loss);
  judge_cameras(rig, state, options, result);
  const std::set<int> boards = boards_in_use(round.bundle);
  for (const auto& [frame, board_idx] : round.board_of_frame) {
    if (boards.contains(board_idx)) {
      result.world_from_board[frame] = chain.world_from_board.at(frame);
    }
  }
  judge_adjustment(result);
  return result;
}

}  // namespace atelier
