#include "pipeline/animation/animated_cloth.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/depths_inside.h"
#include "core/error.h"
#include "core/saturating_cast.h"
#include "core/store/digest_meter.h"
#include "simulation/contact/crossings.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kTorn = 0.5;  // of an edge's length: no cloth stretches like that

/// Of every edge, increasing.
std::vector<double> strains(const Cloth& cloth, const Points& x) {
  std::vector<double> all;
  for (int s = 0; s < cloth.fibre_count; ++s) {
    const ClothSpring& spring = cloth.springs[static_cast<std::size_t>(s)];
    all.push_back(std::abs((x.row(spring.a) - x.row(spring.b)).norm() / spring.rest - 1));
  }
  std::sort(all.begin(), all.end());
  return all;
}

double at_percent(const std::vector<double>& increasing, std::size_t percent) {
  return increasing.empty() ? 0 : increasing[(increasing.size() - 1) * percent / 100];
}

/// Faces of all garments in one cloth.
Triangles joined_faces(const WornCloth& worn) {
  Triangles faces(0, 3);
  for (std::size_t g = 0; g < worn.meshes.size(); ++g) {
    const Index before = faces.rows();
    faces.conservativeResize(before + worn.meshes[g].faces.rows(), 3);
    faces.bottomRows(worn.meshes[g].faces.rows()) =
        worn.meshes[g].faces.array() + static_cast<int>(worn.first[g]);
  }
  return faces;
}

}  // namespace

FrameFigures frame_figures(const Animation& animation, const Points& cloth, const Points& body) {
  FrameFigures figures;
  if (cloth.rows() == 0) {
    return figures;
  }
  figures.strain_p99 = at_percent(strains(animation.worn.cloth, cloth), 99);
  const Eigen::VectorXd depths =
      depths_inside(cloth, body, animation.body.model.mesh.faces, animation.worn.solver.thickness);
  figures.inside = static_cast<double>((depths.array() > 0).count());
  figures.depth = depths.maxCoeff();
  figures.crossings = count_crossings(cloth, joined_faces(animation.worn));
  return figures;
}

FrameReport frame_report(const Animation& animation, int frame_id, const Points& cloth,
                         const FrameFigures& figures) {
  const std::vector<double> increasing = strains(animation.worn.cloth, cloth);
  FrameReport report;
  report.frame = frame_id;
  report.strain_p95 = at_percent(increasing, 95);
  report.strain_max = at_percent(increasing, 100);
  report.crossings = static_cast<int>(figures.crossings);
  report.inside = static_cast<int>(figures.inside);
  report.inside_depth = figures.depth;
  return report;
}

ClothState AnimatedCloth::at(Index row) {
  if (animation_.foreign) {
    return foreign_at(row);
  }
  if (animation_.worn.cloth.rest_positions.rows() == 0) {
    return {Points(0, 3), Points(0, 3), step_of(animation_, row)};
  }
  const std::lock_guard lock(mutex_);
  if (!solver_) {
    start_before(row);
  }
  while (waiting_.find(row) == waiting_.end()) {
    ATELIER_CHECK(next_ <= row, "a frame is asked for twice");
    advance_to(step_of(animation_, next_));
    waiting_[next_++] = solver_->state();
  }
  ClothState state = std::move(waiting_.at(row));
  waiting_.erase(row);
  return state;
}

void AnimatedCloth::start_before(Index row) {
  const WornCloth& worn = animation_.worn;
  solver_ =
      create_solver({worn.cloth, animation_.body.model.mesh.faces}, worn.solver, run_.device());
  solver_->set_state(worn.state);
  for (Index before = row - 1; before >= 0; --before) {
    if (const auto file = finished(before)) {
      const AnimatedFrame frame = read_animated_frame(*file, worn.cloth.rest_positions.rows());
      solver_->set_state(frame.state);
      step_ = static_cast<int>(frame.state.frame);
      next_ = before + 1;
      break;
    }
  }
  body_ = body_after(animation_, step_);
  // Told as work of its own: it may take as long as many frames, whose rate it would spoil.
  const int first = step_;
  const int lead = animation_.steps_before;
  for (; step_ < lead; advance_to(step_ + 1)) {
    run_.progress(step_ - first, lead - first, "steps before the first frame");
  }
  if (step_ > first) {
    run_.progress(step_ - first, lead - first, "steps before the first frame");
  }
}

void AnimatedCloth::advance_to(int step) {
  while (step_ < step) {
    if (run_.stop_requested()) {  // asked here: before the first frame there are thousands of steps
      throw StopRequested();
    }
    const auto start = Clock::now();
    Control control;
    control.body_start = body_;
    body_ = body_after(animation_, step_ + 1);
    control.body_end = body_;
    control.pin_targets =
        pin_targets(animation_.worn.held, body_, animation_.body.model.mesh.faces);
    const FrameReport report = solver_->step(control);
    ++step_;
    ++steps_;
    seconds_ += std::chrono::duration<double>(Clock::now() - start).count();
    if (!(report.strain_p95 < kTorn)) {
      char found[120];
      std::snprintf(found, sizeof found, "cloth stretched by %.0f%% at %.2f s",
                    100 * report.strain_p95, step_ * animation_.step_seconds);
      throw DataError("simulation", "", found,
                      "a motion and a body that the garment follows: a slower motion, another "
                      "--body, or more " +
                          solver_flag("substeps", "cloth", animation_.worn.solver));
    }
  }
}

ClothState AnimatedCloth::foreign_at(Index row) const {
  const Sequence& sequence = *animation_.foreign;
  const double rate = sequence.fps > 0 ? sequence.fps : animation_.fps;
  const auto at =
      saturating_cast<Index>(std::round(static_cast<double>(row) / animation_.fps * rate));
  ClothState state;
  state.positions = frame(sequence, std::min(at, frame_count(sequence) - 1)).vertices;
  state.velocities = Points::Zero(state.positions.rows(), 3);
  state.frame = step_of(animation_, row);
  return state;
}

std::optional<fs::path> AnimatedCloth::finished(Index row) const {
  try {
    return run_.frame_file(animation_.frame_ids[static_cast<std::size_t>(row)]);
  } catch (const LogicError&) {
    return std::nullopt;  // that is how the run says that it is not finished
  }
}

}  // namespace atelier
