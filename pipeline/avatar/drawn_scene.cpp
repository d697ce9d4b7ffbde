#include "pipeline/avatar/drawn_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "appearance/learnt_occlusion.h"
#include "bodymodel/formats/personal_body.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/safetensors.h"
#include "core/nearest_name.h"
#include "core/render/framing.h"
#include "core/sequence_archive.h"
#include "core/store/result.h"
#include "core/usage_error.h"
#include "pipeline/avatar/avatar_result.h"
#include "pipeline/outfit/worn_subject.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

fs::path current_result(const fs::path& workspace, const std::string& stage) {
  const fs::path results = results_of_stage(workspace, stage);
  const auto current = current_name(results);
  if (!current) {
    throw DataError((workspace / stage).string(), "", "no result",
                    "a result; run 'atelier " + stage + "' first");
  }
  return results / *current;
}

/// @param is_garment  has a network; a body is grey without its own, which is made on demand
void add_layer(DrawnScene& drawn, const std::string& name, const fs::path& networks,
               bool is_garment, Triangles faces, Sequence sequence) {
  SceneLayer layer;
  layer.name = name;
  const fs::path model = networks / name / "model.safetensors";
  layer.model = fs::exists(model) ? model.string() : "";
  if (layer.model.empty() && is_garment) {
    const std::string stage = networks.parent_path().filename().string();
    throw DataError(model.string(), "", "no network", "the one that 'atelier " + stage + "' makes");
  }
  layer.faces = std::move(faces);
  drawn.sequences.push_back(std::move(sequence));
  drawn.scene.layers.push_back(std::move(layer));
}

void add_meshes(DrawnScene& drawn, const std::string& name, const fs::path& meshes,
                const fs::path& networks) {
  MeshSequenceFile read =
      read_mesh_sequence(meshes, name == "body" ? SequenceOf::Body : SequenceOf::Cloth);
  // A folder of meshes has faces in each; read.sequence then has none.
  add_layer(drawn, name, networks, name != "body", std::move(read.shared.faces),
            std::move(read.sequence));
}

}  // namespace

DrawnScene ground_truth_scene(const DrawnSources& sources) {
  const fs::path networks = current_result(sources.workspace, "oracle");
  const auto truth = std::make_shared<const GroundTruth>(read_ground_truth(sources.capture));
  const WornSubject worn = worn_in_truth(sources.capture, truth);
  const CaptureInfo info = open_dataset(sources.capture).info;
  const auto clothed = std::find_if(info.sequences.begin(), info.sequences.end(),
                                    [](const auto& one) { return one.kind != "minimal"; });
  if (clothed == info.sequences.end()) {
    throw DataError(sources.capture, "sequences", "none that is clothed", "a clothed one");
  }
  DrawnScene drawn;
  for (std::size_t s = 0; s < worn.templates.size(); ++s) {
    Sequence sequence;
    sequence.fps = clothed->fps;
    sequence.frame_ids = clothed->frame_ids;
    sequence.load = [load = worn.subject.load, ids = clothed->frame_ids,
                     faces = worn.subject.faces[s], s](Index i) {
      Mesh mesh;
      mesh.vertices = load(ids[static_cast<std::size_t>(i)])[s];
      mesh.faces = faces;
      return mesh;
    };
    add_layer(drawn, worn.subject.names[s], networks, s >= worn.first_garment,
              worn.subject.faces[s], std::move(sequence));
  }
  return drawn;
}

void use_avatar(DrawnScene& drawn, const fs::path& workspace) {
  const auto avatar_name = current_name(workspace / "avatar");
  const auto person_name = current_name(workspace / "personalize");
  SceneLayer& layer = drawn.scene.layers.front();
  if (!avatar_name || !person_name) {
    return;
  }
  const auto avatar = std::make_shared<const BodyAvatar>(read_body_avatar(
      workspace / "avatar" / *avatar_name,
      read_personal_body(workspace / "personalize" / *person_name / "person.npz").model));
  if (!equal_arrays(avatar->rest.faces, layer.faces)) {
    return;  // of another body, which is asked for by --body
  }
  constexpr double kSame = 1e-5;  // of texture coordinates, which files keep as floats
  const Mesh first =
      frame_count(drawn.sequences.front()) > 0 ? frame(drawn.sequences.front(), 0) : Mesh();
  const bool seen_already = first.uvs.rows() > 0 && first.uvs.rows() == avatar->rest.uvs.rows() &&
                            equal_arrays(first.uv_faces, avatar->rest.uv_faces) &&
                            (first.uvs - avatar->rest.uvs).cwiseAbs().maxCoeff() < kSame;
  layer.model = avatar->model.string();
  layer.over = over_clothes(*avatar);
  if (seen_already) {
    return;  // meshes of `seen`, which have the texture's atlas
  }
  Sequence& bodies = drawn.sequences.front();
  bodies.load = [seen = seen_bodies(*avatar, frame_count(bodies),
                                    [load = bodies.load](Index i) { return load(i).vertices; }),
                 load = bodies.load](Index i) {
    Mesh mesh = load(i);
    mesh.vertices = seen(i);
    return mesh;
  };
}

DrawnScene drawn_scene(const DrawnSources& sources) {
  const fs::path workspace = sources.workspace;
  const fs::path networks = current_result(workspace, "appearance");
  DrawnScene drawn;
  add_meshes(drawn, "body",
             sources.body.empty() ? current_result(workspace, "body") : fs::path(sources.body),
             networks);
  std::map<std::string, fs::path> given;
  for (const std::string& garment : sources.garments) {
    const std::size_t at = garment.find('=');
    if (at == std::string::npos || at == 0) {
      throw UsageError("--garment takes NAME=MESHES, as in dress=simulated/dress, not '" +
                       garment.substr(0, 80) + "'");
    }
    given[garment.substr(0, at)] = garment.substr(at + 1);
  }
  // Of the manifest, not of the folder: a garment whose folder is gone would be left out unsaid.
  std::set<std::string> names;
  for (const ManifestOutput& output : read_manifest(networks, "appearance").outputs) {
    const fs::path path = output.path;
    if (path.filename() == "model.safetensors" && path.parent_path() != "body") {
      names.insert(path.parent_path().string());
    }
  }
  for (const std::string& name : names) {
    const auto found = given.find(name);
    add_meshes(drawn, name,
               found != given.end() ? found->second
                                    : current_result(workspace, "register") / "registered" / name,
               networks);
    if (found != given.end()) {
      given.erase(found);
    }
  }
  if (!given.empty()) {
    const std::string name = given.begin()->first.substr(0, 80);
    throw UsageError("the workspace has no network of a garment '" + name + "'" +
                     did_you_mean(name, {names.begin(), names.end()}));
  }
  return drawn;
}

void require_body(const DrawnScene& drawn, const DrawnSources& sources, const Warn& warn) {
  if (sources.body.empty()) {
    return;
  }
  const std::vector<SceneLayer>& layers = drawn.scene.layers;
  const Triangles& faces = layers[0].faces;
  for (std::size_t i = 1; i < layers.size(); ++i) {
    if (equal_arrays(layers[i].faces, faces)) {
      throw DataError(sources.body, "faces", "those of " + layers[i].name,
                      "meshes of the body; --garment " + layers[i].name + "=MESHES takes these");
    }
  }
  const fs::path stage = fs::path(sources.workspace) / "body";
  if (const auto current = current_name(stage)) {
    const Index own = open_sequence(stage / *current).faces.rows();
    if (own != faces.rows()) {
      warn("--body has " + std::to_string(faces.rows()) + " triangles, the workspace's body " +
           std::to_string(own) + ": is it a body?");
    }
  }
}

void fill_frames(DrawnScene& drawn, const std::vector<double>& chosen, const Warn& warn) {
  const auto is_chosen = [&](int id) {
    return chosen.empty() || std::find(chosen.begin(), chosen.end(), id) != chosen.end();
  };
  for (const int id : drawn.sequences[0].frame_ids) {
    if (!is_chosen(id)) {
      continue;
    }
    std::vector<Points> vertices;
    for (const Sequence& sequence : drawn.sequences) {
      const auto at = std::lower_bound(sequence.frame_ids.begin(), sequence.frame_ids.end(), id);
      if (at != sequence.frame_ids.end() && *at == id) {
        vertices.push_back(frame(sequence, at - sequence.frame_ids.begin()).vertices);
      }
    }
    if (vertices.size() == drawn.sequences.size()) {
      drawn.scene.frame_ids.push_back(id);
      drawn.scene.vertices.push_back(std::move(vertices));
    }
  }
  std::size_t most = 0;
  for (const Sequence& sequence : drawn.sequences) {
    const auto count =
        std::count_if(sequence.frame_ids.begin(), sequence.frame_ids.end(), is_chosen);
    most = std::max({most, static_cast<std::size_t>(count), chosen.size()});
  }
  if (const std::size_t all = drawn.scene.frame_ids.size(); all > 0 && all < most) {
    warn(std::to_string(all) + " of " + std::to_string(most) +
         " frames are drawn: those that body and garments share");
  }
  if (drawn.scene.frame_ids.empty()) {
    throw DataError("", "frames", "none that body and garments share",
                    "sequences whose frames have the same numbers");
  }
}

void require_light(const DrawnScene& drawn, const OcclusionOptions& asked) {
  if (asked.strata <= 0 && asked.reach <= 0 && asked.offset < 0) {
    return;
  }
  for (const SceneLayer& layer : drawn.scene.layers) {
    if (layer.model.empty()) {
      continue;
    }
    const std::string problem = occlusion_problem(
        asked, {layer.name, occlusion_at(read_safetensors(layer.model).metadata, layer.model)});
    if (!problem.empty()) {
      throw UsageError(problem + "; leave it out");
    }
  }
}

std::vector<Camera> subject_cameras(const DrawnScene& drawn, const View& view, bool turn,
                                    const PictureOptions& picture) {
  Index count = 0;
  for (const std::vector<Points>& frame : drawn.scene.vertices) {
    for (const Points& layer : frame) {
      count += layer.rows();
    }
  }
  Points all(count, 3);
  Index at = 0;
  for (const std::vector<Points>& frame : drawn.scene.vertices) {
    for (const Points& layer : frame) {
      all.middleRows(at, layer.rows()) = layer;
      at += layer.rows();
    }
  }
  const int frames = static_cast<int>(drawn.scene.frame_ids.size());
  return turn ? turntable_cameras(all, view, frames, picture.width, picture.height, picture.framing)
              : std::vector<Camera>{
                    camera_around(all, view, picture.width, picture.height, picture.framing)};
}

double scene_frame_rate(const DrawnScene& drawn) {
  double rate = 0;
  for (std::size_t i = 0; i < drawn.sequences.size(); ++i) {
    const double own = drawn.sequences[i].fps;
    constexpr double kSame = 1e-6;  // of it
    if (own > 0 && rate > 0 && std::abs(own - rate) > kSame * rate) {
      char found[60];
      std::snprintf(found, sizeof found, "%g frames a second", own);
      char expected[60];
      std::snprintf(expected, sizeof expected, "%g, as those before them", rate);
      throw DataError("", "meshes of " + drawn.scene.layers[i].name, found, expected);
    }
    rate = own > 0 ? own : rate;
  }
  return rate;
}

}  // namespace atelier
