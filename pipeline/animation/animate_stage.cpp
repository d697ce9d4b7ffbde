#include "pipeline/animation/animate_stage.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "bodymodel/formats/body_archive.h"
#include "core/archive.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "core/store/digest_meter.h"
#include "core/store/frame_memory.h"
#include "core/store/output_sequences.h"
#include "pipeline/animation/animated_cloth.h"
#include "pipeline/animation/animation_signer.h"
#include "pipeline/avatar/avatar_drawing.h"
#include "pipeline/avatar/surface_faults.h"
#include "pipeline/cloth/scene_check.h"
#include "pipeline/pictures/paint_scene.h"
#include "pipeline/pictures/picture_size.h"
#include "pipeline/pictures/straight_alpha.h"
#include "simulation/simulation_diagnostics.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kStripFrames = 8;
constexpr double kMinVideoRate = 0.1;  // 1/s

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Meshes over one topology at the animation's frames.
SequenceHeader animation_header(const Animation& animation, const Mesh& shared) {
  SequenceHeader header;
  header.fps = animation.fps;
  header.frame_ids = animation.frame_ids;
  header.shared.faces = shared.faces;
  header.shared.uvs = shared.uvs;
  header.shared.uv_faces = shared.uv_faces;
  return header;
}

/// The files written for every frame: the state of the simulation, the body, each garment.
std::vector<OutputSequence> animated_sequences(const Animation& animation) {
  std::vector<OutputSequence> sequences = {
      {"frames", std::nullopt},
      {"body/frames", animation_header(animation, animation.body.model.mesh)}};
  if (animation.avatar) {
    sequences.push_back({"seen/frames", animation_header(animation, animation.avatar->rest)});
  }
  for (std::size_t g = 0; g < animation.worn.names.size(); ++g) {
    sequences.push_back({"garments/" + animation.worn.names[g] + "/frames",
                         animation_header(animation, animation.worn.meshes[g])});
  }
  return sequences;
}

/// A frame in the order of `animated_sequences`.
/// @param seen  [V,3] m of the avatar; no rows: none
std::vector<Archive> animated_archives(const Animation& animation, const AnimatedFrame& frame,
                                       const Points& body, const Points& seen) {
  Mesh mesh;
  mesh.vertices = body;
  std::vector<Archive> archives{archive_of(frame), archive_of(mesh)};
  if (animation.avatar) {
    mesh.vertices = seen;
    archives.push_back(archive_of(mesh));
  }
  for (std::size_t g = 0; g < animation.worn.names.size(); ++g) {
    mesh.vertices = frame.state.positions.middleRows(animation.worn.first[g],
                                                     animation.worn.meshes[g].vertices.rows());
    archives.push_back(archive_of(mesh));
  }
  return archives;
}

/// All clothes as one surface.
JoinedSurfaces joined_clothes(const Animation& animation, const Points& cloth) {
  std::vector<Points> vertices;
  for (std::size_t g = 0; g < animation.worn.meshes.size(); ++g) {
    vertices.emplace_back(
        cloth.middleRows(animation.worn.first[g], animation.worn.meshes[g].vertices.rows()));
  }
  std::vector<Surface> surfaces;
  for (std::size_t g = 0; g < vertices.size(); ++g) {
    surfaces.push_back({&vertices[g], &animation.worn.meshes[g].faces});
  }
  return joined_surfaces(surfaces);
}

/// The body as it is rendered: seen with its texture, where there is an avatar and a look to it.
RenderMesh rendered_body(const Animation& animation, Index row, const Points& body,
                         const Points& cloth, const Look& look) {
  RenderMesh wearer;
  wearer.look = look;
  wearer.mesh.faces = animation.body.model.mesh.faces;
  wearer.mesh.vertices = body;
  if (look.texture) {
    const BodyAvatar& avatar = *animation.avatar;
    wearer.mesh.uvs = avatar.rest.uvs;
    wearer.mesh.uv_faces = avatar.rest.uv_faces;
    wearer.mesh.vertices = tucked_skin(animation.seen(row), wearer.mesh.faces,
                                       joined_clothes(animation, cloth), over_clothes(avatar));
  }
  return wearer;
}

/// The body's and the clothes' surfaces in a frame, as they are rendered.
std::vector<RenderMesh> dressed_meshes(const Animation& animation, Index row, const Points& body,
                                       const Points& cloth, const Look& skin) {
  std::vector<RenderMesh> meshes = {rendered_body(animation, row, body, cloth, skin)};
  for (std::size_t g = 0; g < animation.worn.meshes.size(); ++g) {
    Mesh garment = animation.worn.meshes[g];
    garment.vertices = cloth.middleRows(animation.worn.first[g], garment.vertices.rows());
    meshes.push_back({std::move(garment), cloth_look(g)});
  }
  return meshes;
}

/// Gets the image of every frame, in order.
using TakePicture = std::function<void(const Image& picture)>;

/// Draws all frames in plain colours, the body with the texture of its avatar. False if the run was
/// told to stop.
bool draw_plain(StageRun& run, const Animation& animation, const AnimationView& view,
                const std::vector<Points>& bodies, const std::vector<Points>& cloths,
                const TakePicture& take) {
  const AnimationViewOptions& options = run.options<AnimateOptions>().view;
  const bool textured = animation.avatar && options.drawn_by != "plain";
  const Look skin = textured ? textured_skin_look(std::make_shared<const Image>(
                                   avatar_model_at(animation.avatar->model).static_texture))
                             : skin_look();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (run.stop_requested()) {
      return false;
    }
    take(animation_picture(
        view, static_cast<int>(i),
        dressed_meshes(animation, static_cast<Index>(i), bodies[i], cloths[i], skin), options));
  }
  return true;
}

/// The layers that are drawn, each by its network, or in one colour where it has none.
std::vector<SceneLayer> drawn_layers(const Animation& animation) {
  std::vector<SceneLayer> layers;
  const auto add = [&](const std::string& name, const Eigen::Vector3f& color,
                       const Triangles& faces) {
    const auto found = animation.networks.find(name);
    layers.push_back(
        {name, found == animation.networks.end() ? "" : found->second.string(), color, faces});
  };
  add("body", skin_look().color, animation.body.model.mesh.faces);
  if (animation.avatar) {
    layers.back().over = over_clothes(*animation.avatar);
  }
  for (std::size_t g = 0; g < animation.worn.names.size(); ++g) {
    add(animation.worn.names[g], cloth_look(g).color, animation.worn.meshes[g].faces);
  }
  return layers;
}

/// Says whether the body's texture stays where its network learnt it, by some of the frames.
void tell_texture(StageRun& run, const Animation& animation, const PaintedScene& scene) {
  const AppearanceModel model = avatar_model_at(animation.avatar->model);
  if (!model.drawn) {
    return;
  }
  DressedSubject subject;
  for (const SceneLayer& layer : scene.layers) {
    subject.names.push_back(layer.name);
    subject.faces.push_back(layer.faces);
  }
  subject.load = [&](int row) { return scene.vertices[static_cast<std::size_t>(row)]; };
  constexpr std::size_t kAsked = 8;
  const std::size_t count = scene.vertices.size();
  AppearanceColors all;
  for (std::size_t i = 0; i < std::min(kAsked, count); ++i) {
    const std::size_t row = i * count / std::min(kAsked, count);
    const AppearanceColors colors =
        drawn_views(animation.avatar->model, model, subject, {scene.cameras[row]},
                    {static_cast<int>(row)}, run.device())
            .colors;
    all.drawn.insert(all.drawn.end(), colors.drawn.begin(), colors.drawn.end());
    all.fixed.insert(all.fixed.end(), colors.fixed.begin(), colors.fixed.end());
  }
  const DrawnRange range = drawn_range(all);
  run.metric("drawn_low", range.low);
  run.metric("drawn_high", range.high);
  constexpr double kBeyond = 1.25;
  if (range.high > kBeyond * model.drawn->high || kBeyond * range.low < model.drawn->low) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "the body is drawn with %.2f to %.2f of its mean texture, and its network learnt "
                  "from %.2f to %.2f: poses and light are unlike those of the capture",
                  range.low, range.high, model.drawn->low, model.drawn->high);
    run.warn(text);
  }
}

/// Draws all frames by networks.
bool draw_by_networks(StageRun& run, const Animation& animation, const AnimationView& view,
                      const std::vector<Points>& bodies, const std::vector<Points>& cloths,
                      const TakePicture& take) {
  PaintedScene scene;
  scene.layers = drawn_layers(animation);
  scene.cameras = view.cameras;
  scene.frame_ids = animation.frame_ids;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    std::vector<Points> vertices = {animation.avatar ? animation.seen(static_cast<Index>(i))
                                                     : bodies[i]};
    for (std::size_t g = 0; g < animation.worn.names.size(); ++g) {
      vertices.emplace_back(
          cloths[i].middleRows(animation.worn.first[g], animation.worn.meshes[g].vertices.rows()));
    }
    scene.vertices.push_back(std::move(vertices));
  }
  PaintOptions options;
  options.alpha = view.alpha;
  const Eigen::Vector3f& behind = view.studio.background.bottom;
  options.background = {behind.x(), behind.y(), behind.z()};
  PaintHooks hooks;
  hooks.stop = [&] { return run.stop_requested(); };
  hooks.picture = [&](Index /*frame_idx*/, const Image& picture) {
    take(view.alpha ? picture : before_black(picture));
  };
  if (!paint_scene(scene, options, run.device(), hooks)) {
    return false;
  }
  if (animation.avatar) {
    tell_texture(run, animation, scene);
  }
  return true;
}

/// Images of every frame, a video and a strip. False if the run was told to stop.
bool write_pictures(StageRun& run, const Animation& animation, const std::vector<Points>& bodies,
                    const std::vector<Points>& cloths) {
  const auto& options = run.options<AnimateOptions>().view;
  const auto frames = static_cast<Index>(bodies.size());
  Points corners(static_cast<Index>(16 * bodies.size()), 3);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto row = static_cast<Index>(16 * i);
    corners.middleRows(row, 8) = box_corners(bodies[i]);
    corners.middleRows(row + 8, 8) = box_corners(cloths[i].rows() > 0 ? cloths[i] : bodies[i]);
  }
  const AnimationView view = animation_view(corners, first_azimuth(animation),
                                            static_cast<int>(frames), animation.cameras, options);
  const std::optional<SignedRender> signer = animation_signer(run, !animation.networks.empty());
  const fs::path video = run.scratch_folder() / "animation.mp4";
  VideoWriter writer(video, {.fps = std::max(kMinVideoRate, animation.fps)});
  std::vector<CaptionedImage> strip;
  const std::size_t every =
      std::max<std::size_t>(1, (bodies.size() + kStripFrames - 1) / kStripFrames);
  const auto start = Clock::now();
  const TakePicture take = [&](const Image& picture) {
    const auto i = static_cast<std::size_t>(writer.frames());
    const Image own = view.alpha ? straight_alpha(picture) : picture;
    const Image opaque = view.alpha ? before_black(picture) : picture;
    const std::string file = "pictures/" + frame_name(animation.frame_ids[i]) + ".png";
    if (signer) {
      const ByteImage marked = signer->marked(own);
      run.output_text(file, signer->png(marked));
      writer.add(view.alpha ? signer->marked(opaque) : marked);
    } else {
      run.output_text(file, image_bytes(own, ImageFormat::Png));
      writer.add(opaque);
    }
    if (i % every == 0) {
      char caption[40];
      std::snprintf(caption, sizeof caption, "%.2f s", static_cast<double>(i) / animation.fps);
      strip.push_back({opaque, caption});
    }
    run.progress(writer.frames(), frames, "images");
  };
  run.progress(0, frames, "images");
  const auto draw = animation.networks.empty() ? draw_plain : draw_by_networks;
  if (!draw(run, animation, view, bodies, cloths, take)) {
    return false;
  }
  run.metric("picture_seconds", seconds_since(start) / static_cast<double>(frames));
  log_animation(run, signer);
  signer
      ? writer.finish([&](const fs::path& written) { return signer->video_credentials(written); })
      : writer.finish();
  run.output("animation.mp4", [&](const fs::path& file) {
    fs::copy_file(video, file, fs::copy_options::overwrite_existing);
  });
  ContactSheetOptions sheet;
  sheet.columns = static_cast<int>(strip.size());
  sheet.cell_width = std::min(240, strip.front().image.width);
  const Image strip_image = contact_sheet(strip, sheet);
  run.output_text("strip.png", signer ? signer->png(signer->marked(strip_image))
                                      : image_bytes(strip_image, ImageFormat::Png));
  if (signer) {
    run.output_text(kAnimationStatement, render_statement_text(signer->statement()));
  }
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
    for (const auto& [name, member] : kFrameFigures) {
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

/// Says where the cloth is hardly to be trusted, as `simulate` does.
void warn_of_diagnostics(StageRun& run, const Animation& animation,
                         const std::vector<FrameFigures>& figures,
                         const std::vector<Points>& cloths) {
  std::vector<FrameReport> reports;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    reports.push_back(frame_report(animation, animation.frame_ids[i], cloths[i], figures[i]));
  }
  // How another simulator treats cloth is not ours to say.
  const bool self_contact = animation.foreign || animation.worn.solver.self_contact;
  for (const std::string& doubt : simulation_diagnostics(
           reports, self_contact, {animation.worn.solver, "cloth", "--cloth.contact"})) {
    run.warn(doubt);
  }
}

/// Says which garments have left their places, and how far at most what holds them is from there.
void tell_places(StageRun& run, const Animation& animation, const std::vector<Points>& bodies,
                 const std::vector<Points>& cloths) {
  if (animation.places.empty()) {
    return;
  }
  std::vector<RingLeft> left(animation.places.size());
  double farthest = 0;
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    for (std::size_t p = 0; p < left.size(); ++p) {
      left[p].add(
          ring_distance(animation.places[p], cloths[i], bodies[i], animation.body.model.mesh.faces),
          animation.frame_ids[i]);
      farthest = std::max(farthest, left[p].distance);
    }
  }
  run.metric("held_distance", farthest);
  for (const std::string& doubt : left_places(animation.places, left)) {
    run.warn(doubt);
  }
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

/// The parts of a frame that images and figures need.
struct KeptAnimation {
  Points body;   ///< [B,3] m
  Points cloth;  ///< [V,3] m
  FrameFigures figures;
  SurfaceFaults faults;  ///< of the seen surface
};

/// The avatar's surface in a frame; no rows without an avatar.
Points seen_of(const Animation& animation, Index row) {
  return animation.avatar ? animation.seen(row) : Points(0, 3);
}

SurfaceFaults faults_of(const Animation& animation, const Points& body, const Points& seen) {
  if (seen.rows() == 0) {
    return {};
  }
  const Mesh& rest = animation.body.model.mesh;
  return surface_faults(rest.faces, rest.vertices, animation.avatar->rest.vertices, body, seen);
}

/// Says in how far the seen surface is one in every frame.
void tell_faults(StageRun& run, const Animation& animation,
                 const std::vector<SurfaceFaults>& faults) {
  constexpr double kTorn = 4;  // times as long
  if (!animation.avatar) {
    return;
  }
  SurfaceFaults most;
  int torn = -1;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    most.inverted = std::max(most.inverted, faults[i].inverted);
    if (faults[i].stretch > std::max(kTorn, most.stretch)) {
      torn = animation.frame_ids[i];
    }
    most.stretch = std::max(most.stretch, faults[i].stretch);
  }
  run.metric("seen_inverted", most.inverted);
  run.metric("seen_stretch", most.stretch);
  if (torn >= 0) {
    char times[16];
    std::snprintf(times, sizeof times, "%.1f", most.stretch);
    run.warn("an edge of the body as it is seen is " + std::string(times) +
             " times as long in frame " + std::to_string(torn) +
             " as its pose makes it: hair or shoes may be torn there");
  }
}

}  // namespace

void run_animate(StageRun& run) {
  const auto& options = run.options<AnimateOptions>();
  for (const std::string& doubt : require_consent(run.consent(), options.use)) {
    run.warn(doubt);
  }
  if (options.pictures) {
    require_picture_size(options.view.picture);
    if (!options.sign.empty()) {
      animation_signer(run, false);  // a wrong key is refused before minutes of simulation
    }
  }
  require_solver(options.cloth.solver, run.device());
  Animation animation = read_animation(run);
  const std::vector<int>& ids = animation.frame_ids;
  if (animation.avatar) {
    animation.seen = seen_bodies(*animation.avatar, static_cast<Index>(ids.size()), [&](Index i) {
      return body_after(animation, step_of(animation, i));
    });
  }
  AnimatedCloth frames(run, animation);
  const auto row_of = [&](int id) {
    return std::lower_bound(ids.begin(), ids.end(), id) - ids.begin();
  };
  FrameMemory<KeptAnimation> memory;
  try {
    if (!output_sequences(run, animated_sequences(animation), ids, [&](int id) {
          AnimatedFrame frame{frames.at(row_of(id)), {}};
          Points body = body_after(animation, step_of(animation, row_of(id)));
          frame.figures = frame_figures(animation, frame.state.positions, body);
          const Points seen = seen_of(animation, row_of(id));
          std::vector<Archive> archives = animated_archives(animation, frame, body, seen);
          const SurfaceFaults faults = faults_of(animation, body, seen);
          memory.keep(id,
                      {std::move(body), std::move(frame.state.positions), frame.figures, faults});
          return archives;
        })) {
      return;
    }
  } catch (const StopRequested&) {
    return;  // in the midst of a frame or on the way to the first
  }
  const Index vertices = animation.worn.first.back();
  std::vector<Points> bodies;
  std::vector<Points> cloths;
  std::vector<FrameFigures> figures;
  std::vector<SurfaceFaults> faults;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    KeptAnimation kept = memory.take(ids[i], [&]() -> KeptAnimation {
      const auto row = static_cast<Index>(i);
      AnimatedFrame frame = read_animated_frame(run.frame_file(ids[i]), vertices);
      Points body = body_after(animation, step_of(animation, row));
      const SurfaceFaults own = faults_of(animation, body, seen_of(animation, row));
      return {std::move(body), std::move(frame.state.positions), frame.figures, own};
    });
    bodies.push_back(std::move(kept.body));
    cloths.push_back(std::move(kept.cloth));
    figures.push_back(kept.figures);
    faults.push_back(kept.faults);
  }
  run.output("body.npz", [&](const fs::path& file) { write_body(file, animation.body.model); });
  run.output("motion.npz",
             [&](const fs::path& file) { write_motion(file, played_motion(animation)); });
  if (options.pictures && !write_pictures(run, animation, bodies, cloths)) {
    return;
  }
  write_figures(run, animation, figures, vertices);
  warn_of_diagnostics(run, animation, figures, cloths);
  tell_places(run, animation, bodies, cloths);
  tell_faults(run, animation, faults);
  if (!animation.registered.empty()) {
    run.metric("registered_distance", distance_to_registered(animation, cloths));
  }
  if (frames.simulated()) {
    run.metric("seconds_a_frame", frames.seconds_a_step() * animation.steps_per_frame);
  }
}

}  // namespace atelier
