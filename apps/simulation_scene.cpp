#if defined(ATELIER_HAS_SIMULATION)

#include "apps/simulation_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <memory>

#include "apps/joined_names.h"
#include "apps/scene_check.h"
#include "apps/usage_error.h"
#include "core/device.h"
#include "core/error.h"
#include "core/garment_archive.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/sequence_folder.h"
#include "core/median.h"
#include "core/mesh_statistics.h"
#include "core/nearest_name.h"
#include "core/normals.h"
#include "core/sequence_archive.h"
#include "core/tree.h"
#include "simulation/contact_distance.h"
#include "simulation/fabric.h"
#include "simulation/weld_seams.h"
#ifdef ATELIER_HAS_CAPTURE
#include "apps/mesh_sequence_file.h"
#endif
#ifdef ATELIER_HAS_BODYMODEL
#include "bodymodel/body_file.h"
#include "bodymodel/default_human.h"
#include "bodymodel/motion_file.h"
#include "bodymodel/retarget.h"
#include "bodymodel/skinning.h"
#endif

namespace atelier {
namespace {

/// Body vertices at any time from those at whole frames.
struct BodyTrack {
  Triangles faces;
  double fps = 0;
  Index count = 0;
  std::function<Points(Index)> at;
};

Points between(const BodyTrack& track, double time) {
  const double place = std::clamp(time * track.fps, 0.0, static_cast<double>(track.count - 1));
  const auto first = static_cast<Index>(place);
  const double share = place - static_cast<double>(first);
  if (share < 1e-9) {
    return track.at(first);
  }
  return (1 - share) * track.at(first) + share * track.at(first + 1);
}

/// Frames are asked for twice in a row or more: the last two are kept.
std::function<Points(Index)> keeping_two(std::function<Points(Index)> load) {
  struct Kept {
    Index frame = -1;
    Points points;
  };
  auto kept = std::make_shared<std::array<Kept, 2>>();
  return [kept, load = std::move(load)](Index frame) {
    for (const Kept& k : *kept) {
      if (k.frame == frame) {
        return k.points;
      }
    }
    Kept& oldest = (*kept)[0].frame < (*kept)[1].frame ? (*kept)[0] : (*kept)[1];
    oldest = {frame, load(frame)};
    return oldest.points;
  };
}

BodyTrack track_of(const Sequence& sequence, const std::string& file, double fps) {
  BodyTrack track;
  const Mesh first = frame(sequence, 0);
  track.faces = first.faces;
  track.fps = fps;
  track.count = atelier::frame_count(sequence);
  track.at = keeping_two([sequence, file, faces = first.faces](Index i) {
    Mesh mesh = frame(sequence, i);
    if (mesh.faces.rows() != faces.rows() || mesh.faces != faces) {
      throw DataError(file, "frame " + std::to_string(i), "another topology than the first frame's",
                      "one body that moves");
    }
    return std::move(mesh.vertices);
  });
  return track;
}

#ifdef ATELIER_HAS_BODYMODEL
bool named_human(const std::filesystem::path& body) {
  return body == "female" || body == "male";
}

BodyModel posable_body(const std::filesystem::path& body, std::vector<std::string>& notes) {
  if (named_human(body)) {
    return default_human(body == "male" ? male_human() : female_human());
  }
  BodyFile file = read_body_file(body);
  for (const Finding& finding : file.findings) {
    notes.push_back(finding.what);
  }
  return std::move(file.model);
}

/// From the rest pose into the motion, then along it.
BodyTrack moving_body(const ScenePaths& paths, double fps, double fall_in,
                      std::vector<std::string>& notes) {
  if (std::filesystem::is_directory(paths.body) &&
      !std::filesystem::exists(paths.body / "base.obj")) {
    throw UsageError("--motion moves a body model; '" + paths.body.string() +
                     "' is a folder of meshes, which move by themselves");
  }
  const auto model = [&] {
    try {
      return std::make_shared<BodyModel>(posable_body(paths.body, notes));
    } catch (const DataError& error) {
      if (error.where == "groups") {  // an OBJ that is not MakeHuman's
        throw DataError(error.file, "rig", "none, and a mesh without a rig cannot be posed",
                        error.expected + "; or without --motion");
      }
      throw;
    }
  }();
  const MotionClip clip = read_motion_file(paths.motion);
  RetargetOptions options;
  options.fps = fps;
  Retargeted moved = retarget(clip, *model, {}, options);
  for (const Finding& finding : moved.findings) {
    notes.push_back(finding.what);
  }
  if (moved.motion.poses.empty()) {
    throw DataError(paths.motion.string(), "frames", "none", "a motion of at least one frame");
  }
  auto poses = std::make_shared<std::vector<Pose>>();
  const Pose& first = moved.motion.poses.front();
  const auto steps = static_cast<Index>(std::lround(fall_in * fps));
  for (Index i = 0; i < steps; ++i) {
    // Slow at both ends, so that nothing is thrown.
    const double t = static_cast<double>(i) / static_cast<double>(steps);
    const double share = t * t * (3 - 2 * t);
    poses->push_back({share * first.root_translation, share * first.rotations});
  }
  poses->insert(poses->end(), moved.motion.poses.begin(), moved.motion.poses.end());
  auto body = std::make_shared<ShapedBody>(shape_body(*model));
  BodyTrack track;
  track.faces = model->mesh.faces;
  track.fps = fps;
  track.count = static_cast<Index>(poses->size());
  track.at = keeping_two([model, body, poses](Index i) {
    return skin_vertices(*model, *body, (*poses)[static_cast<std::size_t>(i)]);
  });
  return track;
}
#endif

/// A mesh, a folder of meshes, a sequence of ours, or one file of a sequence (.h5).
Sequence body_sequence(const std::filesystem::path& body) {
  if (std::filesystem::exists(body / "sequence.h5")) {
    return open_sequence(body);
  }
#ifdef ATELIER_HAS_CAPTURE
  if (lower_extension(body) == ".h5") {
    return read_mesh_sequence(body, false).sequence;
  }
#endif
  if (!std::filesystem::exists(body)) {
    throw DataError(body.string(), "", "no such file or folder",
                    "a mesh, a folder of meshes, a body model, female or male" +
                        did_you_mean(body.string(), {"female", "male"}));
  }
  return read_sequence_folder(body);
}

/// `paths` has a body.
BodyTrack read_body_track(const ScenePaths& paths, const SimulateOptions& options,
                          std::vector<std::string>& notes) {
#ifdef ATELIER_HAS_BODYMODEL
  if (!paths.motion.empty()) {
    return moving_body(paths, options.fps, options.fall_in, notes);
  }
  const std::string extension = lower_extension(paths.body);
  if (named_human(paths.body) || extension == ".npz") {
    return track_of(sequence_of({posable_body(paths.body, notes).mesh}, 1), paths.body.string(), 1);
  }
#else
  if (!paths.motion.empty()) {
    throw UsageError("--motion needs a build with body models");
  }
#endif
  const Sequence sequence = body_sequence(paths.body);
  if (options.body_fps > 0 && sequence.fps > 0 && sequence.fps != options.body_fps) {
    notes.push_back(paths.body.string() + " says " + std::to_string(sequence.fps) +
                    " frames a second; --body-fps is taken instead");
  }
  const double fps = options.body_fps > 0 ? options.body_fps
                     : sequence.fps > 0   ? sequence.fps
                                          : options.fps;
  return track_of(sequence, paths.body.string(), fps);
}

/// Refuses a flat shape that is not the surface's size, as coordinates of a texture are not. Cloth
/// that hangs or fits tightly is a tenth longer than flat, hardly more.
void require_flat_size(const Garment& garment, const std::filesystem::path& file) {
  std::vector<double> ratios;
  for (Index f = 0; f < garment.mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto length = [&](const auto& rows, const Triangles& faces) {
        return (rows.row(faces(f, k)) - rows.row(faces(f, (k + 1) % 3))).norm();
      };
      const double surface = length(garment.mesh.vertices, garment.mesh.faces);
      if (surface > 0) {
        ratios.push_back(length(garment.rest, garment.rest_faces) / surface);
      }
    }
  }
  const double ratio = ratios.empty() ? 0 : median(ratios);
  constexpr double kMost = 1.25;
  if (!(ratio > 1 / kMost && ratio < kMost)) {
    char text[80];
    std::snprintf(text, sizeof text, "edges %.3g times as long as the surface's", ratio);
    throw DataError(file.string(), "texture coordinates", text,
                    "a flat rest shape in metres, as garment.obj of flatten and garment.h5 of "
                    "drape have it");
  }
}

/// A mesh, or an archive of a garment with rest shape, seams and attachments, `scale` times as
/// large.
Garment read_garment(const std::filesystem::path& file, bool flat_rest, double scale) {
  Garment garment;
  if (lower_extension(file) == ".json") {
    throw DataError(file.string(), "file name", "a pattern, which has no shape in space yet",
                    "a mesh or garment.h5 of atelier drape --garment " + file.filename().string() +
                        " --out FOLDER");
  }
  const std::string drafted = nearest_name(file.string(), {"dress", "tee", "skirt", "trousers"});
  if (!drafted.empty() && !std::filesystem::exists(file)) {
    throw DataError(file.string(), "", "no such file",
                    "a mesh or a garment.h5; '" + drafted + "' is drafted and put on by atelier " +
                        "drape --garment " + drafted + " --out FOLDER");
  }
  if (lower_extension(file) == ".h5") {
    garment = read_garment_archive(file);
    garment.rest *= scale;  // what is larger is larger at rest, too
  } else {
    garment.mesh = read_mesh(file);
  }
  garment.name = file.string();
  garment.mesh.vertices *= scale;
  if (flat_rest) {
    if (garment.mesh.uv_faces.rows() != garment.mesh.faces.rows()) {
      throw DataError(file.string(), "texture coordinates", "none",
                      "those of every triangle's corners, in metres: garment.obj of flatten");
    }
    garment.rest = garment.mesh.uvs;
    garment.rest_faces = garment.mesh.uv_faces;
  }
  return garment;
}

/// Vertices near the top ride on the body's nearest triangle, as a waistband or collar does. A
/// vertex is told by its foot on the triangle's plane, so that it starts exactly where it is.
void attach_top(Garment& garment, const Points& body, const Triangles& faces, double depth) {
  const double top = garment.mesh.vertices.col(1).maxCoeff();
  const TriangleTree tree = build_tree(body, faces);
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d p = garment.mesh.vertices.row(v).transpose();
    if (p.y() < top - depth) {
      continue;
    }
    Attachment attachment;
    attachment.vertex = static_cast<int>(v);
    attachment.triangle = closest_point(tree, p).face;
    const Eigen::Vector3d a = body.row(faces(attachment.triangle, 0)).transpose();
    const Eigen::Vector3d e1 = Eigen::Vector3d(body.row(faces(attachment.triangle, 1))) - a;
    const Eigen::Vector3d e2 = Eigen::Vector3d(body.row(faces(attachment.triangle, 2))) - a;
    const Eigen::Vector3d normal = e1.cross(e2);
    const double square = normal.squaredNorm();
    if (!(square > 0)) {
      continue;
    }
    const Eigen::Vector3d d = p - a;
    attachment.barycentric[1] = d.cross(e2).dot(normal) / square;
    attachment.barycentric[2] = e1.cross(d).dot(normal) / square;
    attachment.barycentric[0] = 1 - attachment.barycentric[1] - attachment.barycentric[2];
    attachment.distance = d.dot(normal) / std::sqrt(square);
    garment.attachments.push_back(attachment);
  }
}

}  // namespace

OptionTable describe(SimulateOptions& options) {
  OptionTable table;
  table.add("fps", options.fps, 1, 10000, "1/s", "Simulated frames a second");
  table.add("settle", options.settle, 0, 1000000, "", "Frames on the first body before it moves");
  table.add("length", options.length, 0, 10000000, "",
            "Frames in all; 0 for as long as the body moves");
  table.add("body_fps", options.body_fps, 0, 10000, "1/s",
            "Frames a second of body meshes; 0 for what they say, else as simulated");
  table.add("fall_in", options.fall_in, 0, 60, "s",
            "From the rest pose, in which the garment is put on, to a motion's first pose");
  table.add("pin_top", options.pin_top, 0, 1, "m",
            "How far below its top the garment rides on the body");
  table.add("scale", options.scale, 1e-6, 1e6, "", "Metres per unit of the garment's file");
  table.add("move_x", options.move_x, -1000, 1000, "m",
            "How far the garment is moved along x once it is scaled (to the default human's left)");
  table.add("move_y", options.move_y, -1000, 1000, "m",
            "How far it is moved up: bodies stand on y = 0");
  table.add("move_z", options.move_z, -1000, 1000, "m",
            "How far it is moved along z (to the default human's front)");
  table.add("flat_rest", options.flat_rest,
            "Texture coordinates are the flat rest shape in metres, as in garment.obj of flatten");
  table.add("relax", options.relax,
            "The garment is captured, so its weight has stretched it: find the unloaded one that "
            "hangs so on the first body");
  table.add("relaxing", describe(options.relaxing));
  table.add("sewn", options.sewn, "Close the garment's seams before it moves");
  table.add(describe(options.cloth));
  table.add("wind", options.wind, -200, 200, "m/s", "Three numbers, or none for still air");
  table.add("material", describe_said(options.material, fabric_names()));
  OptionTable xpbd = describe(options.xpbd);
  std::erase_if(xpbd.fields, [](const OptionField& field) {
    return field.name == "time_step" || field.name == "report";
  });
  for (OptionField& field : xpbd.fields) {
    field.keyed = true;  // what is counted is in the result
  }
  return table.add("xpbd", xpbd);
}

std::string relaxed_text(const RelaxedGarment& relaxed, double seconds) {
  char text[200];
  std::snprintf(text, sizeof text,
                "without its weight: after %.2g s it hangs %.2f mm (mean; most %.2f mm) from the "
                "captured shape, %d rounds%s",
                seconds, 1e3 * relaxed.mean_error, 1e3 * relaxed.largest_error, relaxed.rounds,
                relaxed.converged ? "" : "; not as near as asked");
  return text;
}

ScenePaths scene_in(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) {
    throw DataError(folder.string(), "scene", "no folder",
                    "a folder with garment.obj, and body.obj or body/, and motion.bvh");
  }
  std::vector<std::filesystem::path> entries;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    entries.push_back(entry.path());
  }
  std::sort(entries.begin(), entries.end());
  ScenePaths out;
  std::filesystem::path garment;
  const auto take = [&](std::filesystem::path& to, const std::filesystem::path& from) {
    if (!to.empty()) {
      throw DataError(folder.string(), from.filename().string(),
                      "a second one beside " + to.filename().string(), "one of each");
    }
    to = from;
  };
  for (const std::filesystem::path& entry : entries) {
    std::string small = entry.stem().string();
    std::transform(small.begin(), small.end(), small.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (small != entry.stem() && (small == "garment" || small == "body" || small == "motion")) {
      throw DataError(folder.string(), entry.filename().string(), "a name with capitals",
                      small + entry.extension().string() + ", in small letters");
    }
    if (entry.stem() == "garment") {
      take(garment, entry);
    } else if (entry.stem() == "body") {
      take(out.body, entry);
    } else if (entry.stem() == "motion") {
      take(out.motion, entry);
    }
  }
  if (garment.empty()) {
    throw DataError(folder.string(), "garment", "none", "garment.obj, .ply or .glb");
  }
  out.garments.push_back(garment);
  return out;
}

namespace {

ClothOptions cloth_options(const SimulateOptions& options) {
  ClothOptions cloth = options.cloth;
  if (options.relax) {
    cloth.rest_angles = "template";
  }
  return cloth;
}

void relax_scene(SimulationScene& scene, const SimulateOptions& options, Device device) {
  RelaxedGarment relaxed = relax_gravity(
      scene.garments[0], {}, scene.body ? scene.body(0) : Points(0, 3), scene.body_faces,
      cloth_options(options), scene_solver(scene, options), options.relaxing, device);
  if (scene.body && options.xpbd.thickness < 0) {
    scene.thickness = relaxed.gap;
    char text[160];
    std::snprintf(text, sizeof text,
                  "keeps %.2g mm from the body, as it was captured where it rests on it "
                  "(--xpbd.thickness says otherwise)",
                  1e3 * relaxed.gap);
    scene.notes.emplace_back(text);
  }
  scene.notes.push_back(relaxed_text(relaxed, options.relaxing.seconds));
  scene.garments[0] = std::move(relaxed.garment);
}

}  // namespace

namespace {

/// What is smooth of the body meets the cloth's vertices alone: it keeps off by what its edges
/// need, unless something else is said.
void keep_off(SimulationScene& scene, const SimulateOptions& options) {
  double edge = 0;
  double needed = 0;
  for (const Garment& garment : scene.garments) {
    edge = std::max(edge, mean_edge_length(garment.mesh));
    needed = std::max(needed, contact_distance(garment));
  }
  if (options.xpbd.thickness >= 0 || !(needed > scene.garments[0].material.thickness)) {
    return;
  }
  scene.thickness = needed;
  char text[160];
  std::snprintf(text, sizeof text,
                "keeps %.2g mm from the body, as edges of %.2g mm need (--xpbd.thickness says "
                "otherwise)",
                1e3 * needed, 1e3 * edge);
  scene.notes.emplace_back(text);
}

}  // namespace

SimulationScene read_scene_body(const ScenePaths& paths, const SimulateOptions& options) {
  SimulationScene scene;
  double seconds = 0;
  if (!paths.body.empty()) {
    const BodyTrack track = read_body_track(paths, options, scene.notes);
    require_surface(track.at(0), track.faces, paths.body);
    scene.body_faces = track.faces;
    seconds = static_cast<double>(track.count - 1) / track.fps;
    scene.body = [track, fps = options.fps, settle = options.settle](Index frame) {
      return between(track, static_cast<double>(frame - settle) / fps);
    };
  }
  scene.frame_count = options.length > 0
                          ? options.length
                          : options.settle + static_cast<Index>(std::lround(seconds * options.fps));
  if (scene.frame_count == 0) {
    throw UsageError("there is nothing to simulate: give --settle or --length");
  }
  return scene;
}

std::vector<std::filesystem::path> garment_paths(const std::string& text) {
  if (std::filesystem::exists(text) || text.find('+') == std::string::npos) {
    return {text};
  }
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : joined_names(text)) {
    if (name.empty()) {
      throw UsageError("--garment '" + text.substr(0, 80) +
                       "' has a garment without a name; it takes files joined by +");
    }
    paths.emplace_back(name);
  }
  return paths;
}

namespace {

/// A garment as it is put on: scaled, moved, of the scene's material, with its seams closed.
Garment placed_garment(const std::filesystem::path& file, const SimulateOptions& options,
                       const Material& material) {
  Garment garment = read_garment(file, options.flat_rest, options.scale);
  garment.mesh.vertices.rowwise() +=
      Eigen::RowVector3d(options.move_x, options.move_y, options.move_z);
  if (options.flat_rest) {
    require_flat_size(garment, file);
  }
  garment.material = material;
  require_garment_options(garment, options);
  return options.sewn && !garment.seams.empty() ? weld_seams(garment) : garment;
}

/// Stems of the garments' files, told apart by their place where two are alike.
std::vector<std::string> short_names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : files) {
    std::string name = file.stem().string();
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      name += "_" + std::to_string(names.size() + 1);
    }
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace

SimulationScene read_scene(const ScenePaths& paths, const SimulateOptions& options, Device device) {
  require_scene_options(paths, options, device);
  check_device(device);
  const Material material = said_material(options.material);
  std::vector<Garment> garments;
  for (const std::filesystem::path& file : paths.garments) {
    garments.push_back(placed_garment(file, options, material));
  }
  SimulationScene scene = read_scene_body(paths, options);
  scene.garments = std::move(garments);
  scene.names = short_names(paths.garments);
  scene.first.push_back(0);
  for (const Garment& garment : scene.garments) {
    scene.first.push_back(scene.first.back() + garment.mesh.vertices.rows());
  }
  scene.start.resize(scene.first.back(), 3);
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    const Points& vertices = scene.garments[g].mesh.vertices;
    scene.start.middleRows(scene.first[g], vertices.rows()) = vertices;
  }
  if (scene.body) {
    if (!options.relax) {
      keep_off(scene, options);
    }
    for (std::size_t g = 0; g < scene.garments.size(); ++g) {
      if (options.pin_top > 0) {
        attach_top(scene.garments[g], scene.body(0), scene.body_faces, options.pin_top);
      }
      require_held(scene.garments[g], scene.body_faces, paths.garments[g]);
    }
  }
  if (options.relax) {
    relax_scene(scene, options, device);
  }
  for (std::string& doubt : scene_doubts(scene, options.xpbd.contact_reach)) {
    scene.notes.push_back(std::move(doubt));
  }
  return scene;
}

Cloth scene_cloth(const SimulationScene& scene, const SimulateOptions& options) {
  std::vector<Cloth> cloths;
  for (const Garment& garment : scene.garments) {
    cloths.push_back(make_cloth(garment, {}, cloth_options(options)));
  }
  return cloths.size() == 1 ? cloths.front() : join_cloths(cloths);
}

std::vector<Mesh> garment_meshes(const SimulationScene& scene, const Points& positions) {
  std::vector<Mesh> meshes;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    Mesh mesh;
    mesh.vertices = positions.middleRows(scene.first[g], scene.first[g + 1] - scene.first[g]);
    mesh.faces = scene.garments[g].mesh.faces;
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

ClothState scene_start(const SimulationScene& scene, const Cloth& cloth) {
  ClothState state = rest_state(cloth);
  state.positions = scene.start;
  return state;
}

XpbdOptions scene_solver(const SimulationScene& scene, const SimulateOptions& options) {
  XpbdOptions solver = options.xpbd;
  solver.time_step = 1 / options.fps;
  if (scene.thickness >= 0) {
    solver.thickness = scene.thickness;
  }
  return solver;
}

Control scene_control(const SimulationScene& scene, const SimulateOptions& options, Index frame) {
  Control control;
  if (scene.body) {
    control.body_start = scene.body(frame - 1);
    control.body_end = scene.body(frame);
  }
  if (!options.wind.empty()) {
    control.wind = {options.wind[0], options.wind[1], options.wind[2]};
  }
  // However short a run is, how it ends is known.
  control.exact_counts = frame == scene.frame_count && options.xpbd.intersection_interval > 0;
  return control;
}

FrameReport advance_scene(ClothSolver& solver, const SimulationScene& scene,
                          const SimulateOptions& options, Index frame, const ScenePaths& paths,
                          const std::string& kept) {
  const std::string before = frame > 1 ? kept : "";
  try {
    return solver.advance(scene_control(scene, options, frame));
  } catch (const EnvironmentError& error) {  // out of a device's memory, say
    throw EnvironmentError(error.place, error.reason + before);
  } catch (const DataError& error) {
    const bool of_body = error.where.starts_with("body");
    std::string file = of_body ? paths.body.string() : "";
    for (std::size_t g = 0; g < paths.garments.size() && !of_body; ++g) {
      file += (g == 0 ? "" : "+") + paths.garments[g].string();
    }
    throw DataError(error.file.empty() ? file : error.file,
                    of_body ? "frame " + std::to_string(frame) + ", " + error.where : error.where,
                    error.found, error.expected + before);
  }
}

}  // namespace atelier

#endif
