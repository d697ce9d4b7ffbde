#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_CORE_RENDER)

#include "apps/animate_stage.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/picture_size.h"
#include "bodymodel/body_archive.h"
#include "capture/capture_measures.h"
#include "capture/truth_archive.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "simulation/crossings.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kSchema = "atelier.animated_frame";
constexpr double kTorn = 0.5;  // of an edge's length: no cloth stretches like that
constexpr int kStripFrames = 8;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What one frame of the result says of itself.
struct FrameFigures {
  double strain_p99 = 0;
  double inside = 0;  // vertices
  double depth = 0;   // m
  double crossings = 0;
};

constexpr std::array<std::pair<const char*, double FrameFigures::*>, 4> kFigures = {
    {{"strain_p99", &FrameFigures::strain_p99},
     {"inside", &FrameFigures::inside},
     {"depth", &FrameFigures::depth},
     {"crossings", &FrameFigures::crossings}}};

double strain_p99(const Cloth& cloth, const Points& x) {
  std::vector<double> strains;
  for (int s = 0; s < cloth.fibre_count; ++s) {
    const ClothSpring& spring = cloth.springs[static_cast<std::size_t>(s)];
    strains.push_back(std::abs((x.row(spring.a) - x.row(spring.b)).norm() / spring.rest - 1));
  }
  if (strains.empty()) {
    return 0;
  }
  const auto at = strains.begin() + static_cast<std::ptrdiff_t>((strains.size() - 1) * 99 / 100);
  std::nth_element(strains.begin(), at, strains.end());
  return *at;
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

FrameFigures figures_of(const Animation& animation, const Points& cloth, const Points& body) {
  FrameFigures figures;
  if (cloth.rows() == 0) {
    return figures;
  }
  figures.strain_p99 = strain_p99(animation.worn.cloth, cloth);
  const Eigen::VectorXd depths =
      depths_inside(cloth, body, animation.body.model.mesh.faces, animation.worn.solver.thickness);
  figures.inside = static_cast<double>((depths.array() > 0).count());
  figures.depth = depths.maxCoeff();
  figures.crossings = count_crossings(cloth, joined_faces(animation.worn));
  return figures;
}

void write_frame(const fs::path& file, const ClothState& state, const FrameFigures& figures) {
  Archive archive;
  archive.schema = kSchema;
  archive.numbers["step"] = static_cast<double>(state.frame);
  for (const auto& [name, member] : kFigures) {
    archive.numbers[name] = figures.*member;
  }
  archive.datasets["positions"] = tensor_of(state.positions);
  archive.datasets["velocities"] = tensor_of(state.velocities);
  write_archive(file, archive);
}

struct AnimatedFrame {
  ClothState state;
  FrameFigures figures;
};

AnimatedFrame read_frame(const fs::path& file, Index vertices) {
  const Archive archive = read_archive(file, kSchema, 1);
  const auto rows = [&](const char* name) {
    const auto found = archive.datasets.find(name);
    if (found == archive.datasets.end() || found->second.type != element_type_for<double>() ||
        found->second.shape != std::vector<std::int64_t>{vertices, 3}) {
      throw DataError(file.string(), name, "not of this cloth",
                      std::to_string(vertices) + " rows of three numbers");
    }
    return Points(Eigen::Map<const Points>(values_of<double>(found->second).data(), vertices, 3));
  };
  const auto number = [&](const char* name) {
    const auto found = archive.numbers.find(name);
    if (found == archive.numbers.end()) {
      throw DataError(file.string(), name, "none", "a number");
    }
    return found->second;
  };
  AnimatedFrame frame;
  frame.state.positions = rows("positions");
  frame.state.velocities = rows("velocities");
  frame.state.frame = static_cast<std::int64_t>(number("step"));
  for (const auto& [name, member] : kFigures) {
    frame.figures.*member = number(name);
  }
  return frame;
}

/// The cloth in every frame of the result: simulated in order, whoever asks for which, or taken
/// from another simulator.
class ClothFrames {
 public:
  ClothFrames(StageRun& run, const Animation& animation) : run_(run), animation_(animation) {}

  ClothState at(Index row) {
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

  double seconds_a_step() const { return steps_ > 0 ? seconds_ / steps_ : 0; }
  bool simulated() const { return steps_ > 0; }

 private:
  /// Goes on behind the last frame before `row` that an earlier run has finished.
  void start_before(Index row) {
    const WornCloth& worn = animation_.worn;
    solver_.emplace(worn.cloth, animation_.body.model.mesh.faces, worn.solver, run_.device());
    solver_->set_state(worn.state);
    for (Index before = row - 1; before >= 0; --before) {
      if (const auto file = finished(before)) {
        const AnimatedFrame frame = read_frame(*file, worn.cloth.rest_positions.rows());
        solver_->set_state(frame.state);
        step_ = static_cast<int>(frame.state.frame);
        next_ = before + 1;
        break;
      }
    }
    body_ = body_after(animation_, step_);
  }

  void advance_to(int step) {
    while (step_ < step) {
      const auto start = Clock::now();
      Control control;
      control.body_start = body_;
      body_ = body_after(animation_, step_ + 1);
      control.body_end = body_;
      const FrameReport report = solver_->advance(control);
      ++step_;
      ++steps_;
      seconds_ += seconds_since(start);
      if (!(report.strain_p95 < kTorn)) {
        char found[120];
        std::snprintf(found, sizeof found, "cloth stretched by %.0f%% at %.2f s",
                      100 * report.strain_p95, step_ * animation_.step_seconds);
        throw DataError("simulation", "", found,
                        "a motion and a body that the garment follows: a slower motion, another "
                        "--body, or more --cloth.xpbd.substeps");
      }
    }
  }

  ClothState foreign_at(Index row) const {
    const Sequence& sequence = *animation_.foreign;
    const double rate = sequence.fps > 0 ? sequence.fps : animation_.fps;
    const auto at =
        static_cast<Index>(std::llround(static_cast<double>(row) / animation_.fps * rate));
    ClothState state;
    state.positions = frame(sequence, std::min(at, frame_count(sequence) - 1)).vertices;
    state.velocities = Points::Zero(state.positions.rows(), 3);
    state.frame = step_of(animation_, row);
    return state;
  }

  std::optional<fs::path> finished(Index row) const {
    try {
      return run_.frame_file(animation_.frame_ids[static_cast<std::size_t>(row)]);
    } catch (const LogicError&) {
      return std::nullopt;  // that is how the run says that it is not finished
    }
  }

  StageRun& run_;
  const Animation& animation_;
  std::optional<ClothSolver> solver_;
  std::mutex mutex_;
  int step_ = 0;
  Index next_ = 0;
  Points body_;
  std::map<Index, ClothState> waiting_;
  int steps_ = 0;
  double seconds_ = 0;
};

/// A sequence of one topology, file by file.
void write_meshes(StageRun& run, const Animation& animation, const std::string& folder,
                  const Mesh& shared, const std::function<Points(Index row)>& vertices) {
  SequenceHeader header;
  header.fps = animation.fps;
  header.frame_ids = animation.frame_ids;
  header.shared.faces = shared.faces;
  header.shared.uvs = shared.uvs;
  header.shared.uv_faces = shared.uv_faces;
  run.output(folder + "/sequence.h5",
             [&](const fs::path& file) { write_archive(file, archive_of(header)); });
  for (std::size_t i = 0; i < header.frame_ids.size(); ++i) {
    Mesh mesh;
    mesh.vertices = vertices(static_cast<Index>(i));
    run.output(sequence_frame_path(folder, header.frame_ids[i]).generic_string(),
               [&](const fs::path& file) { write_mesh_archive(file, mesh); });
  }
}

/// The body's and the clothes' surfaces in a frame, as they are rendered.
std::vector<RenderMesh> dressed_meshes(const Animation& animation, const Points& body,
                                       const Points& cloth) {
  std::vector<RenderMesh> meshes;
  Mesh wearer;
  wearer.vertices = body;
  wearer.faces = animation.body.model.mesh.faces;
  meshes.push_back({std::move(wearer), skin_look()});
  for (std::size_t g = 0; g < animation.worn.meshes.size(); ++g) {
    Mesh garment = animation.worn.meshes[g];
    garment.vertices = cloth.middleRows(animation.worn.first[g], garment.vertices.rows());
    meshes.push_back({std::move(garment), cloth_look(g)});
  }
  return meshes;
}

/// Pictures of every frame, a video and a strip. False if the run was told to stop.
bool write_pictures(StageRun& run, const Animation& animation, const std::vector<Points>& bodies,
                    const std::vector<Points>& cloths) {
  const auto& options = run.options<AnimateOptions>().view;
  const auto frames = static_cast<int>(bodies.size());
  Points corners(static_cast<Index>(16 * bodies.size()), 3);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto row = static_cast<Index>(16 * i);
    corners.middleRows(row, 8) = box_corners(bodies[i]);
    corners.middleRows(row + 8, 8) = box_corners(cloths[i].rows() > 0 ? cloths[i] : bodies[i]);
  }
  const AnimationView view = animation_view(corners, frames, animation.cameras, options);
  std::vector<Image> film;
  std::vector<CaptionedImage> strip;
  const int every = std::max(1, (frames + kStripFrames - 1) / kStripFrames);
  const auto start = Clock::now();
  for (int i = 0; i < frames; ++i) {
    if (run.stop_requested()) {
      return false;
    }
    const auto row = static_cast<std::size_t>(i);
    Image picture =
        animation_picture(view, i, dressed_meshes(animation, bodies[row], cloths[row]), options);
    char name[40];
    std::snprintf(name, sizeof name, "pictures/%06d.png", animation.frame_ids[row]);
    run.output_text(name, image_bytes(picture, ImageFormat::Png));
    if (view.alpha) {
      picture = before_black(picture);
    }
    if (i % every == 0) {
      char caption[40];
      std::snprintf(caption, sizeof caption, "%.2f s", i / animation.fps);
      strip.push_back({picture, caption});
    }
    film.push_back(std::move(picture));
    run.progress(i + 1, frames, "pictures");
  }
  run.metric("picture_seconds", seconds_since(start) / frames);
  run.output("animation.mp4", [&](const fs::path& file) {
    write_video(file, frames, [&](Index i) { return film[static_cast<std::size_t>(i)]; },
                {.fps = animation.fps});
  });
  ContactSheetOptions sheet;
  sheet.columns = static_cast<int>(strip.size());
  sheet.cell_width = std::min(240, film.front().width);
  run.output_text("strip.png", image_bytes(contact_sheet(strip, sheet), ImageFormat::Png));
  return true;
}

/// Mean distance of the simulated vertices from where they were registered, m.
double distance_to_registered(const Animation& animation, const std::vector<Points>& cloths) {
  double sum = 0;
  double count = 0;
  for (std::size_t g = 0; g < animation.registered.size(); ++g) {
    const RegisteredGarmentSequence& garment = animation.registered[g];
    const std::vector<int>& ids = garment.registered.frame_ids;
    for (std::size_t i = 0; i < cloths.size(); ++i) {
      if (!std::binary_search(ids.begin(), ids.end(), animation.frame_ids[i])) {
        continue;
      }
      const Points there = registered_mesh(garment, animation.frame_ids[i]).vertices;
      sum += (cloths[i].middleRows(animation.worn.first[g], there.rows()) - there)
                 .rowwise()
                 .norm()
                 .sum();
      count += static_cast<double>(there.rows());
    }
  }
  return count > 0 ? sum / count : 0;
}

void write_figures(StageRun& run, const Animation& animation,
                   const std::vector<FrameFigures>& figures, Index vertices) {
  nlohmann::ordered_json all;
  FrameFigures most;
  double inside = 0;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    nlohmann::ordered_json& json = all["frames"][frame_name(animation.frame_ids[i])];
    for (const auto& [name, member] : kFigures) {
      json[name] = figures[i].*member;
      most.*member = std::max(most.*member, figures[i].*member);
    }
    inside += figures[i].inside;
  }
  run.output_text("figures.json", all.dump(1));
  const auto frames = static_cast<double>(figures.size());
  run.metric("frames", frames);
  run.metric("garments", static_cast<double>(animation.worn.names.size()));
  run.metric("vertices", static_cast<double>(vertices));
  run.metric("strain_p99", most.strain_p99);
  run.metric("penetration_depth", most.depth);
  run.metric("penetration_rate",
             inside / frames / static_cast<double>(std::max<Index>(1, vertices)));
  run.metric("self_intersections", most.crossings);
}

/// The poses as they were played, at the result's rate.
MotionClip played_motion(const Animation& animation) {
  MotionClip clip;
  clip.name = "animation";
  clip.skeleton = animation.body.shaped.skeleton;
  clip.motion.fps = animation.fps;
  clip.motion.frame_ids = animation.frame_ids;
  for (std::size_t i = 0; i < animation.frame_ids.size(); ++i) {
    clip.motion.poses.push_back(pose_at(
        animation.body, step_of(animation, static_cast<Index>(i)) * animation.step_seconds));
  }
  return clip;
}

}  // namespace

void run_animate(StageRun& run) {
  const auto& options = run.options<AnimateOptions>();
  if (options.pictures) {
    require_picture_size(options.view.picture);
  }
  const Animation animation = read_animation(run);
  const std::vector<int>& ids = animation.frame_ids;
  ClothFrames frames(run, animation);
  const auto row_of = [&](int id) {
    return std::lower_bound(ids.begin(), ids.end(), id) - ids.begin();
  };
  if (!run.each_frame("frames", ".h5", ids, [&](int id, const fs::path& file) {
        const ClothState state = frames.at(row_of(id));
        write_frame(file, state,
                    figures_of(animation, state.positions,
                               body_after(animation, step_of(animation, row_of(id)))));
      })) {
    return;
  }
  const Index vertices = animation.worn.first.back();
  std::vector<Points> bodies;
  std::vector<Points> cloths;
  std::vector<FrameFigures> figures;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    AnimatedFrame frame = read_frame(run.frame_file(ids[i]), vertices);
    bodies.push_back(body_after(animation, step_of(animation, static_cast<Index>(i))));
    cloths.push_back(std::move(frame.state.positions));
    figures.push_back(frame.figures);
  }
  write_meshes(run, animation, "body", animation.body.model.mesh,
               [&](Index i) { return bodies[static_cast<std::size_t>(i)]; });
  for (std::size_t g = 0; g < animation.worn.names.size(); ++g) {
    write_meshes(run, animation, "garments/" + animation.worn.names[g], animation.worn.meshes[g],
                 [&](Index i) {
                   return Points(cloths[static_cast<std::size_t>(i)].middleRows(
                       animation.worn.first[g], animation.worn.meshes[g].vertices.rows()));
                 });
  }
  run.output("motion.npz",
             [&](const fs::path& file) { write_motion(file, played_motion(animation)); });
  if (options.pictures && !write_pictures(run, animation, bodies, cloths)) {
    return;
  }
  write_figures(run, animation, figures, vertices);
  if (!animation.registered.empty()) {
    run.metric("registered_distance", distance_to_registered(animation, cloths));
  }
  if (frames.simulated()) {
    run.metric("seconds_a_frame", frames.seconds_a_step() * animation.steps_per_frame);
  }
}

}  // namespace atelier

#endif
