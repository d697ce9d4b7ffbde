#include "capture/calibration/adjust_rig.h"

#include <algorithm>
#include <cmath>

namespace atelier {
namespace {

/// The bundle of everything but the views that are left out.
AdjustmentRound round_of(const std::vector<RigCamera>& rig, const std::vector<Camera>& cameras,
                         const RigAdjustment& state, const std::vector<PosedView>& posed,
                         const BoardPoints& points) {
  const PoseChain& chain = state.chain;
  AdjustmentRound round;
  round.bundle.points = points;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    Bundle::Eye eye;
    eye.model = state.models[c].distortion;
    eye.lens = lens_of(cameras[c]);
    eye.free = state.models[c].free;
    eye.camera_from_world = chain.camera_from_world[c];
    eye.fixed_pose = c == state.fixed;
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
    if (!chain.in_rig[static_cast<std::size_t>(c)] ||
        state.left_out.contains({c, view.view.frame_id})) {
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

/// One round of bundle adjustment: the poses and lenses it finds are those of state and cameras.
/// @param start_loss  px, of a first solution that this one starts from; 0: none
void adjust(const std::vector<RigCamera>& rig, const std::vector<PosedView>& posed,
            const BoardPoints& points, double start_loss, RigAdjustment& state,
            std::vector<Camera>& cameras) {
  state.round = round_of(rig, cameras, state, posed, points);
  AdjustmentRound& round = state.round;
  if (start_loss > 0) {
    round.bundle = solve_bundle(round.bundle, {start_loss, 50}).bundle;
  }
  const BundleSolution solution = solve_bundle(round.bundle, {state.loss, 200});
  round.bundle = solution.bundle;
  round.converged = solution.converged;
  const auto errors = reprojection_errors(round.bundle);
  round.errors.clear();
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    const double error = errors.row(i).norm();
    round.errors.push_back(std::isfinite(error) ? error : 1e6);
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    state.chain.camera_from_world[c] = round.bundle.eyes[c].camera_from_world;
    cameras[c] = with_lens(cameras[c], state.models[c].distortion, round.bundle.eyes[c].lens);
  }
  for (const auto& [frame, board_idx] : round.board_of_frame) {
    state.chain.world_from_board[frame] =
        round.bundle.world_from_board[static_cast<std::size_t>(board_idx)];
  }
}

/// Chooses the lens model of every camera of the rig again, boards where the rig puts them; true if
/// a camera has another one now.
bool choose_lenses_again(const std::vector<RigCamera>& rig, const std::vector<PosedView>& posed,
                         const BoardOptions& board, RigAdjustment& state, Calibration& result) {
  bool changed = false;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (rig[c].known_lens || !state.chain.in_rig[c]) {
      continue;
    }
    std::vector<BoardView> own;
    for (const PosedView& view : posed) {
      if (view.view.camera_idx == static_cast<int>(c)) {
        own.push_back(view.view);
      }
    }
    const SingleLens lens =
        lens_given_boards(posed_camera(result.cameras[c], state.chain, c), state.models[c], own,
                          state.chain.world_from_board, board, state.loss);
    if (lens.found && lens.model.choice != state.models[c].choice) {
      state.models[c] = lens.model;
      result.quality[c].lens = lens.model.name;
      result.cameras[c] = lens.camera;
      state.chain.camera_from_world[c] = rigid_of(lens.camera.camera_from_world_rotation,
                                                  lens.camera.camera_from_world_translation);
      changed = true;
    }
    result.quality[c].candidates = lens.candidates;
  }
  return changed;
}

/// Widens the loss to what the corners turn out to be; true if it is another one now.
bool adapt_loss(double least, RigAdjustment& state) {
  // Cauchy's loss loses little where its width is 2.4 deviations (Holland and Welsch 1977); the
  // median of lengths in the plane is 1.18 deviations.
  const double wide = std::max(least, 2.4 / 1.18 * percentile(state.round.errors, 0.5));
  const bool changed = std::abs(wide - state.loss) > 0.1 * state.loss;
  state.loss = wide;
  return changed;
}

/// Leaves out the views that fit much worse than the median one; true if they are others now.
bool leave_out_misfits(const std::vector<Camera>& cameras, const std::vector<PosedView>& posed,
                       const BoardPoints& points, const CalibrateOptions& options,
                       RigAdjustment& state) {
  const std::map<std::pair<int, int>, double> view_errors =
      errors_of_views(cameras, state.chain, posed, points);
  std::vector<double> sorted;
  for (const auto& [view, error] : view_errors) {
    sorted.push_back(error);
  }
  state.allowed = std::max(options.min_rejected, options.reject * percentile(sorted, 0.5));
  std::set<std::pair<int, int>> bad;
  for (const auto& [view, error] : view_errors) {
    if (error > state.allowed) {
      bad.insert(view);
    }
  }
  const bool changed = bad != state.left_out;
  state.left_out = bad;
  return changed;
}

}  // namespace

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

void adjust_until_settled(const std::vector<RigCamera>& rig, const std::vector<PosedView>& posed,
                          const BoardOptions& board, const CalibrateOptions& options,
                          RigAdjustment& state, Calibration& result) {
  const BoardPoints points = board_points(board);
  constexpr int kRounds = 5;
  for (int turn = 0; turn < kRounds; ++turn) {
    // A start far off needs a loss that still pulls.
    const double start_loss = turn == 0 ? 10 * options.loss : 0;
    adjust(rig, posed, points, start_loss, state, result.cameras);
    if (turn + 1 == kRounds) {
      break;
    }
    bool changed = false;
    if (turn == 0 && options.lens == LensChoice::Auto && rig.size() > 1) {
      changed = choose_lenses_again(rig, posed, board, state, result);
    }
    changed = adapt_loss(options.loss, state) || changed;
    changed = leave_out_misfits(result.cameras, posed, points, options, state) || changed;
    if (!changed) {
      break;
    }
  }
}

}  // namespace atelier
