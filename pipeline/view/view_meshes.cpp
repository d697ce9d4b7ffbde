#include "pipeline/view/view_meshes.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/archive.h"
#include "core/error.h"
#include "core/io/foreign_hdf5.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/npz.h"
#include "core/io/scene_file.h"
#include "core/io/sequence_folder.h"
#include "core/io/usd_mesh.h"
#include "core/sequence_archive.h"
#include "pipeline/view/view_clock.h"
#include "pipeline/view/view_data.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kUsual = 24;  // frames a second of those that do not say

/// The frame of an archive named by its number alone, "000012.h5".
std::optional<int> archive_frame(const fs::path& file) {
  const std::string stem = file.stem().string();
  int id = -1;
  const bool number =
      std::from_chars(stem.data(), stem.data() + stem.size(), id).ptr == stem.data() + stem.size();
  return file.extension() == ".h5" && number && id >= 0 ? std::optional(id) : std::nullopt;
}

/// The name of a file or folder, also of "folder/".
fs::path last_name(const fs::path& place) {
  const fs::path whole = fs::absolute(place).lexically_normal();
  return whole.has_filename() ? whole.filename() : whole.parent_path().filename();
}

ViewScene scene_of_layers(const std::string& title, const std::string& timeline_name,
                          std::vector<ViewLayer> layers) {
  ViewScene scene;
  scene.title = title;
  ViewTimeline timeline;
  timeline.name = timeline_name;
  timeline.layers = std::move(layers);
  set_layer_frames(timeline);
  scene.timelines.push_back(std::move(timeline));
  return scene;
}

ViewScene scene_of_one_mesh(const fs::path& file, Mesh mesh) {
  if (mesh.faces.rows() == 0) {
    throw DataError(file.string(), "", "no faces", "a triangle mesh");
  }
  ViewLayer layer;
  layer.name = file.stem().string();
  layer.role = "scan";
  layer.sequence.frame_ids = {0};
  layer.sequence.load = [mesh = std::move(mesh)](Index /*frame*/) { return mesh; };
  return scene_of_layers(file.filename().string(), "Mesh", {std::move(layer)});
}

/// Whose meshes a place holds: a file may keep those of a body and of cloth beside each other.
std::vector<SequenceOf> parts_of(const fs::path& place) {
  const auto parts = [](const auto& has) {
    std::vector<SequenceOf> all;
    if (!has("vertices") && has("body_vertices")) {
      all.push_back(SequenceOf::Body);
    }
    if (all.empty() || has("cloth_vertices")) {
      all.push_back(SequenceOf::Cloth);
    }
    return all;
  };
  if (fs::is_directory(place) || has_usd_extension(place)) {
    return {SequenceOf::Cloth};
  }
  if (lower_extension(place) == ".npz") {
    const Npz npz(place);
    return parts([&](const char* name) { return npz.contains(name); });
  }
  const ForeignHdf5Contents contents = foreign_hdf5_contents(place);
  return parts([&](const char* name) { return contents.datasets.contains(name); });
}

/// Of files that always say their unit and axis, and are read as they say.
constexpr MeshConvention kSays{.metres_per_unit = 1, .up = 'y'};

/// That a unit or an axis which somebody set does nothing, since the file says its own.
void note_what_is_said(const std::string& name, const MeshConvention& said,
                       const MeshConvention& set, std::vector<std::string>& notes) {
  if (set.up != '\0' && said.up != '\0') {
    notes.push_back(name + " says which axis is up: --input.up does nothing");
  }
  if (set.metres_per_unit > 0 && said.metres_per_unit > 0) {
    notes.push_back(name + " says its unit: --input.unit does nothing");
  }
}

/// What the first mesh of a folder says.
MeshConvention said_by_first(const fs::path& folder, const MeshConvention& otherwise) {
  std::vector<fs::path> meshes;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_mesh_file(entry.path())) {
      meshes.push_back(entry.path());
    }
  }
  MeshConvention said;
  if (!meshes.empty()) {
    const fs::path& first = *std::min_element(meshes.begin(), meshes.end());
    (void)problem_of([&] { said = read_mesh_file(first, otherwise).said; });
  }
  return said;
}

/// Frames of arrays that say neither unit nor axis.
void place_frames(Sequence& sequence, const MeshConvention& otherwise) {
  sequence.load = [load = std::move(sequence.load), otherwise](Index i) {
    return in_metres_y_up(load(i), {}, otherwise);
  };
}

/// A layer of frames that are of one topology, or, with no faces in `sequence`, of their own.
ViewLayer layer_of_frames(const fs::path& place, SequenceOf what, const MeshConvention& otherwise) {
  ViewLayer layer;
  layer.name = last_name(place).stem().string();
  layer.role = layer.name == "body" || layer.name == "seen" ? "body" : "garment";
  const auto read = [&] {
    MeshSequenceFile file = read_mesh_sequence(place, what, {}, otherwise);
    layer.sequence = std::move(file.sequence);
    layer.sequence.faces = file.shared.faces;
    layer.shared = std::move(file.shared);
  };
  if (!fs::is_directory(place)) {
    read();
    return layer;
  }
  if (problem_of(read)) {  // scans, or a frame that cannot be read, which the page says
    layer.role = "scan";
    layer.shared = {};
    layer.sequence = scans_in(place, 0);
    if (layer.sequence.frame_ids.empty()) {
      layer.sequence = read_sequence_folder(place, otherwise);
    }
  }
  return layer;
}

}  // namespace

bool is_mesh_file(const fs::path& file) {
  static const std::set<std::string> endings = {".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx"};
  return endings.contains(lower_extension(file));
}

bool holds_mesh_frames(const fs::path& place) {
  if (std::error_code error; !fs::is_directory(place, error)) {
    static const std::set<std::string> endings = {".h5", ".hdf5", ".npz"};
    return endings.contains(lower_extension(place)) || has_usd_extension(place);
  }
  static const std::set<std::string> frame_endings = {".obj", ".ply", ".glb", ".gltf"};
  bool meshes = false;
  std::error_code error;
  for (const auto& entry :
       fs::directory_iterator(place, fs::directory_options::skip_permission_denied)) {
    if (entry.is_directory(error)) {
      return false;
    }
    meshes = meshes || frame_endings.contains(lower_extension(entry.path())) ||
             archive_frame(entry.path());
  }
  return meshes;
}

Sequence scans_in(const fs::path& folder, double fps) {
  std::map<int, fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (const auto id = archive_frame(entry.path())) {
      const auto [other, is_new] = files.emplace(*id, entry.path());
      if (!is_new) {
        const auto [first, second] = std::minmax(other->second, entry.path());
        throw DataError(folder.string(), "frame " + std::to_string(*id),
                        first.filename().string() + " and " + second.filename().string(),
                        "one file of a frame");
      }
    }
  }
  Sequence scans;
  scans.fps = fps;
  std::vector<fs::path> paths;
  for (const auto& [id, file] : files) {
    scans.frame_ids.push_back(id);
    paths.push_back(file);
  }
  scans.load = [paths = std::move(paths)](Index i) {
    return read_mesh_archive(paths[static_cast<std::size_t>(i)]);
  };
  return scans;
}

ViewScene view_of_mesh(const fs::path& file, const MeshConvention& otherwise,
                       const MeshConvention& set) {
  const std::string name = file.filename().string();
  bool moves = false;
  MeshFile read;
  if (has_scene_extension(file)) {
    const GltfScene scene = read_scene(file);
    moves = !scene.animations.empty();
    read = mesh_of_scene(scene, file.string());
  } else {
    read = read_mesh_file(file, otherwise);
  }
  const MeshConvention said = read.said;
  const std::optional<Finding> unit = unit_finding(read, name);
  const std::vector<Finding> findings = std::move(read.findings);
  ViewScene scene = scene_of_one_mesh(file, std::move(read.mesh));
  for (const Finding& finding : findings) {
    if (finding.severity != Severity::Note) {
      scene.notes.push_back(name + ": " + finding.what);
    }
  }
  note_what_is_said(name, said, set, scene.notes);
  if (unit) {
    scene.notes.push_back(name + ": " + unit->what + "; --input.unit says in what it is");
  }
  if (moves) {
    scene.notes.push_back(name +
                          " is animated, and its first pose alone is shown; view the workspace, or "
                          "an export as h5, usda, ply or obj, for the motion");
  }
  return scene;
}

ViewScene view_of_mesh_frames(const fs::path& place, const MeshConvention& otherwise,
                              const MeshConvention& set) {
  const fs::path name = last_name(place);
  const std::string extension = lower_extension(place);
  std::string schema;  // of an archive of ours
  if (has_usd_extension(place) && !fs::is_directory(place)) {
    UsdMesh usd = read_usd_mesh(place);
    if (usd.frames.empty()) {
      ViewScene scene = scene_of_one_mesh(place, std::move(usd.mesh));
      note_what_is_said(name.string(), kSays, set, scene.notes);
      return scene;
    }
  } else if (extension == ".h5" && !fs::is_directory(place)) {
    // Of other programs there is none, and the reader of sequences says what else is wrong.
    (void)problem_of([&] { schema = archive_contents(place).schema; });
    if (schema == "atelier.mesh") {
      return scene_of_one_mesh(place, read_mesh_archive(place));
    }
    if (!schema.empty() && schema != "atelier.mesh_sequence") {
      throw DataError(place.string(), "", "an archive of " + schema,
                      "a mesh or a sequence of meshes; atelier inspect says what it is");
    }
  }
  std::vector<ViewLayer> layers;
  bool is_guessed = false;
  const std::vector<SequenceOf> parts =
      schema.empty() ? parts_of(place) : std::vector{SequenceOf::Cloth};
  for (const SequenceOf part : parts) {
    ViewLayer layer = layer_of_frames(place, part, otherwise);
    if (schema.empty() && !fs::is_directory(place) && !has_usd_extension(place)) {
      place_frames(layer.sequence, otherwise);
    }
    if (parts.size() > 1 || part == SequenceOf::Body) {
      layer.name = part == SequenceOf::Body ? "body" : "cloth";
      layer.role = part == SequenceOf::Body ? "body" : "garment";
    }
    if (!(layer.sequence.fps > 0) && layer.sequence.frame_ids.size() > 1) {
      is_guessed = true;
      layer.sequence.fps = kUsual;
    }
    layers.push_back(std::move(layer));
  }
  ViewScene scene = scene_of_layers(name.string(), "Sequence", std::move(layers));
  if (fs::is_directory(place)) {
    note_what_is_said(name.string(), said_by_first(place, otherwise), set, scene.notes);
  } else if (!schema.empty() || has_usd_extension(place)) {
    note_what_is_said(name.string(), kSays, set, scene.notes);
  }
  if (is_guessed) {
    scene.notes.push_back(name.string() +
                          " does not say its frames per second; they are played at 24");
  }
  return scene;
}

}  // namespace atelier
