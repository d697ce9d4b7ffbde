#include "pipeline/cloth/simulate_stage.h"

#include <algorithm>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "core/io/image_file.h"
#include "core/sequence_archive.h"
#include "core/store/frame_memory.h"
#include "core/store/output_sequences.h"
#include "pipeline/cloth/scene_watch.h"
#include "pipeline/cloth/simulation_output.h"
#include "simulation/material/membrane_in_use.h"
#include "simulation/simulation_diagnostics.h"
#include "simulation/simulation_table.h"

namespace atelier {
namespace {

/// Simulates in order, whoever asks for which frame.
class FrameSource {
 public:
  FrameSource(StageRun& run, const ScenePaths& paths, const SimulationScene& scene,
              const SimulateOptions& options)
      : run_(run),
        paths_(paths),
        scene_(scene),
        options_(options),
        model_(scene_model(scene, options)),
        solver_(create_solver(model_, scene_solver(scene, options), run.device())) {}

  SimulatedFrame at(int frame) {
    const std::lock_guard lock(mutex_);
    // Frames are asked for about in order: one whose place is behind begins there again.
    if (!started_ || (frame <= done_ && !waiting_.contains(frame))) {
      start_before(frame);
    }
    while (done_ < frame) {
      if (failure_) {  // nobody goes on past a frame that failed
        std::rethrow_exception(failure_);
      }
      try {
        waiting_[done_ + 1] = advanced(done_ + 1);
      } catch (...) {
        failure_ = std::current_exception();
        throw;
      }
      ++done_;
    }
    const auto found = waiting_.find(frame);
    SimulatedFrame simulated = std::move(found->second);
    waiting_.erase(found);
    return simulated;
  }

  Index vertices() const { return model_.cloth.rest_positions.rows(); }
  const Cloth& cloth() const { return model_.cloth; }

 private:
  SimulatedFrame advanced(int frame) {
    try {
      const FrameReport report = advance_scene(*solver_, scene_, options_, frame, paths_);
      return {solver_->state(), report};
    } catch (const std::runtime_error&) {
      throw_with(std::current_exception(), frame > 1 ? "; frames before it are kept" : "");
    }
  }

  /// Goes on behind the last frame before `frame` that an earlier run has finished.
  void start_before(int frame) {
    started_ = true;
    done_ = 0;
    solver_->set_state(scene_start(scene_, model_.cloth));
    for (int before = frame - 1; before > 0; --before) {
      const std::optional<std::filesystem::path> file = finished(before);
      if (file) {
        solver_->set_state(read_simulated_frame(*file, before, vertices()).state);
        done_ = before;
        return;
      }
    }
  }

  std::optional<std::filesystem::path> finished(int frame) const {
    try {
      return run_.frame_file(frame);
    } catch (const LogicError&) {
      return std::nullopt;  // that is how the run says that it is not finished
    }
  }

  StageRun& run_;
  const ScenePaths& paths_;
  const SimulationScene& scene_;
  const SimulateOptions& options_;
  SimulationModel model_;
  std::unique_ptr<Solver> solver_;
  std::mutex mutex_;
  bool started_ = false;
  int done_ = 0;
  std::map<int, SimulatedFrame> waiting_;
  std::exception_ptr failure_;  ///< of the frame behind `done_`
};

/// The parts of a frame that the tables and images of the end need.
struct KeptFrame {
  FrameReport report;
  WatchedFrame watched;
  Points positions;  ///< [V,3] m, of the frames in the contact sheet; else no rows
};

/// The worst of all frames; what was counted in none has no metric.
void add_metrics(StageRun& run, const std::vector<FrameReport>& reports) {
  run.metric("frames", static_cast<double>(reports.size()));
  const auto worst = [&](const char* name, auto member) {
    double most = -1;
    for (const FrameReport& report : reports) {
      most = std::max(most, static_cast<double>(report.*member));
    }
    if (most >= 0) {
      run.metric(name, most);
    }
  };
  worst("strain_p95", &FrameReport::strain_p95);
  worst("penetration_depth", &FrameReport::penetration_depth);
  worst("inside", &FrameReport::inside);
  worst("inside_depth", &FrameReport::inside_depth);
  worst("body_crossings", &FrameReport::body_crossings);
  worst("crossings", &FrameReport::crossings);
  const auto least = [&](const char* name, double FrameReport::*member) {
    double value = -1;
    for (const FrameReport& report : reports) {
      if (report.*member >= 0) {
        value = value < 0 ? report.*member : std::min(value, report.*member);
      }
    }
    if (value >= 0) {
      run.metric(name, value);
    }
  };
  least("body_gap", &FrameReport::body_gap);
  least("self_gap", &FrameReport::self_gap);
}

}  // namespace

void check_simulate_input(const std::filesystem::path& input, const OptionTable& /*options*/) {
  scene_in(input);
}

void run_simulate(StageRun& run) {
  const auto& options = run.options<SimulateOptions>();
  const ScenePaths paths = scene_in(run.input("scene"));
  const SimulationScene scene = read_scene(paths, options, run.device());
  run.say(text_of(membrane_in_use(scene.garments[0], options.cloth)));
  for (const std::string& note : scene.notes) {
    note.starts_with(kWarning) ? run.warn(note.substr(kWarning.size())) : run.say(note);
  }
  std::vector<int> ids;
  for (Index i = 1; i <= scene.frame_count; ++i) {
    ids.push_back(static_cast<int>(i));
  }
  FrameSource source(run, paths, scene, options);
  SequenceHeader header;
  header.fps = options.fps;
  header.frame_ids = ids;
  header.shared.faces = source.cloth().faces;
  const SceneWatch watch(scene, source.cloth(), paths, options);
  const auto kept_of = [&](int id, SimulatedFrame frame) {
    KeptFrame kept{frame.report, watch.at(id, frame.state.positions), Points(0, 3)};
    if (in_sheet(id, scene.frame_count)) {
      kept.positions = std::move(frame.state.positions);
    }
    return kept;
  };
  FrameMemory<KeptFrame> memory;
  const bool complete = output_sequences(
      run, {{"states", std::nullopt}, {"garment/frames", header}}, ids, [&](int id) {
        SimulatedFrame frame = source.at(id);
        Mesh mesh;
        mesh.vertices = frame.state.positions;
        std::vector<Archive> archives{archive_of(frame), archive_of(mesh)};
        memory.keep(id, kept_of(id, std::move(frame)));
        return archives;
      });
  if (!complete) {
    return;
  }
  std::vector<FrameReport> reports;
  std::vector<WatchedFrame> watched;
  std::vector<CaptionedImage> pictures;
  for (const int id : ids) {
    if (run.stop_requested()) {
      return;
    }
    KeptFrame frame = memory.take(id, [&] {
      return kept_of(id, read_simulated_frame(run.frame_file(id), id, source.vertices()));
    });
    reports.push_back(frame.report);
    watched.push_back(std::move(frame.watched));
    if (in_sheet(id, scene.frame_count)) {
      Mesh mesh;
      mesh.vertices = std::move(frame.positions);
      mesh.faces = source.cloth().faces;
      pictures.push_back(sheet_picture(id, {mesh}, scene));
    }
  }
  run.output_text("frames.csv", frames_csv(reports, options.fps));
  run.output_text("sheet.png", image_bytes(simulation_sheet(pictures), ImageFormat::Png));
  add_metrics(run, reports);
  for (const std::string& doubt :
       simulation_diagnostics(reports, options.solver.self_contact, {.solver = options.solver})) {
    run.warn(doubt);
  }
  tell_watched(run, scene, watched);
}

}  // namespace atelier
