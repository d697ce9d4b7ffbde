#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "bodymodel/formats/personal_body.h"
#include "capture/layouts/open_dataset.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/safetensors.h"
#include "core/nearest_name.h"
#include "core/printable.h"
#include "core/render/framing.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/avatar/avatar_result.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/outfit/worn_subject.h"
#include "pipeline/pictures/normal_pictures.h"
#include "pipeline/pictures/paint_scene.h"
#include "pipeline/pictures/picture_size.h"
#include "pipeline/pictures/straight_alpha.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/sealing/signed_render.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct DrawArguments {
  std::string workspace;
  std::string out;
  std::string body;
  std::vector<std::string> garments;
  std::string capture;
  std::string camera;
  std::string signing_key;
  KeyArguments keys;
};

struct DrawOptions {
  std::string networks = "appearance";  ///< whose: "appearance", "oracle"
  double azimuth = 34;                  ///< degrees; as kThreeQuarter
  double elevation = 9;                 ///< degrees
  bool turn = false;                    ///< once round the subject over all frames
  bool normals = false;                 ///< normals of the surfaces instead of networks
  std::vector<double> frames;           ///< numbers of those that are drawn; none: all
  bool avatar = true;                   ///< the body as `avatar` has made it, where it has
  bool mark = true;                     ///< images say what they are
  PictureOptions picture;
  VideoOptions video;
  PaintOptions paint;
  Device device = Device::Cpu;
  ConsentUse use;
};

OptionTable describe(DrawOptions& options) {
  OptionTable table;
  table.add("networks", options.networks, {"appearance", "oracle"},
            "Stage whose networks are used; oracle: those trained and rendered on the ground-truth "
            "garments and body of --capture");
  table.add("azimuth", options.azimuth, -360, 360, "degrees",
            "Azimuth of the camera: 0 in front of the subject, 90 at its left");
  table.add("elevation", options.elevation, -90, 90, "degrees",
            "Elevation of the camera: 0 level, 90 above");
  table.add("turn", options.turn, "Camera that goes once round the subject over all frames");
  table.add("normals", options.normals,
            "Normals of the surfaces as colours, instead of what networks make of them: red to the "
            "right, green upwards, blue towards the camera");
  table.add("frames", options.frames, 0, 1e9, "",
            "Numbers of the frames that are drawn; empty: all");
  table.add("avatar", options.avatar,
            "Body with skin, hair and shoes, where the workspace has an avatar; off: the body that "
            "clothes lie on");
  table.add("mark", options.mark,
            "Invisible mark and content credentials of what is drawn, which verify reads; off: "
            "figures of a paper, to the bit as the networks drew them");
  table.add("width", options.picture.width, 1, 16384, "px",
            "Width of images that are not from a camera of the capture");
  table.add("height", options.picture.height, 1, 16384, "px",
            "Height of images that are not from a camera of the capture");
  table.add("framing", describe(options.picture.framing));
  table.add("video", describe(options.video));
  for (OptionField& field : table.fields) {
    if (field.name == "video.fps") {
      field.help = "Frame rate of the video; unless given, that of the meshes if they have one";
    }
  }
  table.add(describe(options.paint));
  table.add("device", options.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Device of the networks");
  table.add(describe(options.use));
  return table;
}

/// Everything that moves, as it is drawn.
struct Cast {
  PaintedScene scene;
  std::vector<Sequence> sequences;  ///< of the layers
};

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
void add_layer(Cast& cast, const std::string& name, const fs::path& networks, bool is_garment,
               Triangles faces, Sequence sequence) {
  SceneLayer layer;
  layer.name = name;
  const fs::path model = networks / name / "model.safetensors";
  layer.model = fs::exists(model) ? model.string() : "";
  if (layer.model.empty() && is_garment) {
    const std::string stage = networks.parent_path().filename().string();
    throw DataError(model.string(), "", "no network", "the one that 'atelier " + stage + "' makes");
  }
  layer.faces = std::move(faces);
  cast.sequences.push_back(std::move(sequence));
  cast.scene.layers.push_back(std::move(layer));
}

void add_meshes(Cast& cast, const std::string& name, const fs::path& meshes,
                const fs::path& networks) {
  MeshSequenceFile read =
      read_mesh_sequence(meshes, name == "body" ? SequenceOf::Body : SequenceOf::Cloth);
  // A folder of meshes has faces in each; read.sequence then has none.
  add_layer(cast, name, networks, name != "body", std::move(read.shared.faces),
            std::move(read.sequence));
}

/// Ground truth of the first clothed sequence of a synthetic capture.
Cast true_cast(const DrawArguments& arguments) {
  const fs::path networks = current_result(arguments.workspace, "oracle");
  const auto truth = std::make_shared<const GroundTruth>(read_ground_truth(arguments.capture));
  const WornSubject worn = worn_in_truth(arguments.capture, truth);
  const CaptureInfo info = open_dataset(arguments.capture).info;
  const auto clothed = std::find_if(info.sequences.begin(), info.sequences.end(),
                                    [](const auto& one) { return one.kind != "minimal"; });
  if (clothed == info.sequences.end()) {
    throw DataError(arguments.capture, "sequences", "none that is clothed", "a clothed one");
  }
  Cast cast;
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
    add_layer(cast, worn.subject.names[s], networks, s >= worn.first_garment, worn.subject.faces[s],
              std::move(sequence));
  }
  return cast;
}

/// The body as it is seen, where the workspace has an avatar of its faces.
void show_avatar(Cast& cast, const fs::path& workspace) {
  const auto avatar_name = current_name(workspace / "avatar");
  const auto person_name = current_name(workspace / "personalize");
  SceneLayer& layer = cast.scene.layers.front();
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
      frame_count(cast.sequences.front()) > 0 ? frame(cast.sequences.front(), 0) : Mesh();
  const bool seen_already = first.uvs.rows() > 0 && first.uvs.rows() == avatar->rest.uvs.rows() &&
                            equal_arrays(first.uv_faces, avatar->rest.uv_faces) &&
                            (first.uvs - avatar->rest.uvs).cwiseAbs().maxCoeff() < kSame;
  layer.model = avatar->model.string();
  layer.over = over_clothes(*avatar);
  if (seen_already) {
    return;  // meshes of `seen`, which have the texture's atlas
  }
  Sequence& bodies = cast.sequences.front();
  bodies.load = [seen = seen_bodies(*avatar, frame_count(bodies),
                                    [load = bodies.load](Index i) { return load(i).vertices; }),
                 load = bodies.load](Index i) {
    Mesh mesh = load(i);
    mesh.vertices = seen(i);
    return mesh;
  };
}

Cast cast_of(const DrawArguments& arguments) {
  const fs::path workspace = arguments.workspace;
  const fs::path networks = current_result(workspace, "appearance");
  Cast cast;
  add_meshes(cast, "body",
             arguments.body.empty() ? current_result(workspace, "body") : fs::path(arguments.body),
             networks);
  std::map<std::string, fs::path> given;
  for (const std::string& garment : arguments.garments) {
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
    add_meshes(cast, name,
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
  return cast;
}

/// Refuses a garment's meshes as the body's, and warns of meshes that are not as the workspace's:
/// without its network a body is drawn whatever its faces are.
void require_body(const Cast& cast, const DrawArguments& arguments) {
  if (arguments.body.empty()) {
    return;
  }
  const std::vector<SceneLayer>& layers = cast.scene.layers;
  const Triangles& faces = layers[0].faces;
  for (std::size_t i = 1; i < layers.size(); ++i) {
    if (equal_arrays(layers[i].faces, faces)) {
      throw DataError(arguments.body, "faces", "those of " + layers[i].name,
                      "meshes of the body; --garment " + layers[i].name + "=MESHES takes these");
    }
  }
  const fs::path stage = fs::path(arguments.workspace) / "body";
  if (const auto current = current_name(stage)) {
    const Index own = open_sequence(stage / *current).faces.rows();
    if (own != faces.rows()) {
      std::cout << "warning: --body has " << faces.rows() << " triangles, the workspace's body "
                << own << ": is it a body?" << std::endl;
    }
  }
}

/// Frames in which every layer is there, with its vertices.
void fill_frames(Cast& cast, const std::vector<double>& chosen) {
  const auto is_chosen = [&](int id) {
    return chosen.empty() || std::find(chosen.begin(), chosen.end(), id) != chosen.end();
  };
  for (const int id : cast.sequences[0].frame_ids) {
    if (!is_chosen(id)) {
      continue;
    }
    std::vector<Points> vertices;
    for (const Sequence& sequence : cast.sequences) {
      const auto at = std::lower_bound(sequence.frame_ids.begin(), sequence.frame_ids.end(), id);
      if (at != sequence.frame_ids.end() && *at == id) {
        vertices.push_back(frame(sequence, at - sequence.frame_ids.begin()).vertices);
      }
    }
    if (vertices.size() == cast.sequences.size()) {
      cast.scene.frame_ids.push_back(id);
      cast.scene.vertices.push_back(std::move(vertices));
    }
  }
  std::size_t most = 0;
  for (const Sequence& sequence : cast.sequences) {
    const auto count =
        std::count_if(sequence.frame_ids.begin(), sequence.frame_ids.end(), is_chosen);
    most = std::max({most, static_cast<std::size_t>(count), chosen.size()});
  }
  if (const std::size_t all = cast.scene.frame_ids.size(); all > 0 && all < most) {
    std::cout << "warning: " << all << " of " << most
              << " frames are drawn: those that body and garments share" << std::endl;
  }
  if (cast.scene.frame_ids.empty()) {
    throw DataError("", "frames", "none that body and garments share",
                    "sequences whose frames have the same numbers");
  }
}

/// Requires the light that the networks learnt with: they know no other.
void require_light(const Cast& cast, const DrawOptions& options) {
  const OcclusionOptions& asked = options.paint.occlusion;
  if (asked.strata <= 0 && asked.reach <= 0 && asked.offset < 0) {
    return;
  }
  for (const SceneLayer& layer : cast.scene.layers) {
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

/// Whether somebody named this very file or folder as meshes, whatever it holds.
bool is_named(const DrawArguments& arguments, const fs::path& file) {
  const auto is_value = [&](const std::string& value) {
    return file == value.substr(value.find('=') + 1);
  };
  return file == arguments.body ||
         std::any_of(arguments.garments.begin(), arguments.garments.end(), is_value);
}

/// The cast with its frames. What is wrong with a file of a result is said with the stage that
/// recomputes it.
Cast whole_cast(const DrawArguments& arguments, const DrawOptions& options) {
  if (!fs::is_directory(arguments.workspace)) {
    throw DataError(arguments.workspace, "", "no folder", "a workspace");
  }
  try {
    Cast cast = options.networks == "oracle" ? true_cast(arguments) : cast_of(arguments);
    require_body(cast, arguments);
    if (options.avatar && options.networks != "oracle") {
      show_avatar(cast, arguments.workspace);
    }
    require_light(cast, options);
    fill_frames(cast, options.frames);
    return cast;
  } catch (const DataError& error) {
    for (const Stage& stage : all_stages()) {
      // Of a sound result that is no sequence, recomputing it would change nothing.
      const std::string advice =
          is_named(arguments, error.file)
              ? "one in every frame, as the results of 'body' and 'register' (registered/NAME) have"
              : "run 'atelier " + std::string(stage.name) + "' again";
      if (!error.file.empty() &&
          is_inside(error.file, fs::path(arguments.workspace) / stage.name) &&
          error.expected.find("run 'atelier") == std::string::npos) {
        throw DataError(error.file, error.where, error.found, error.expected + "; " + advice);
      }
    }
    throw;
  }
}

/// The camera of the capture that looks; nothing where it goes round the subject, whose images
/// then have a size. Before any mesh is read: what is refused here has nothing to do with them.
std::optional<Camera> captured_camera(const DrawArguments& arguments, const DrawOptions& options) {
  if (arguments.capture.empty()) {
    require_picture_size(options.picture);
    return std::nullopt;
  }
  std::string ids;
  for (const Camera& camera : open_dataset(arguments.capture).cameras) {
    if (camera.id == arguments.camera) {
      return camera;
    }
    ids += (ids.empty() ? "" : ", ") + camera.id;
  }
  throw UsageError("the capture has no camera '" + arguments.camera.substr(0, 80) + "'; it has " +
                   ids);
}

/// Round the subject.
std::vector<Camera> cameras_round(const Cast& cast, const DrawOptions& options) {
  Index count = 0;
  for (const std::vector<Points>& frame : cast.scene.vertices) {
    for (const Points& layer : frame) {
      count += layer.rows();
    }
  }
  Points all(count, 3);
  Index at = 0;
  for (const std::vector<Points>& frame : cast.scene.vertices) {
    for (const Points& layer : frame) {
      all.middleRows(at, layer.rows()) = layer;
      at += layer.rows();
    }
  }
  const View view{options.azimuth * std::numbers::pi / 180,
                  options.elevation * std::numbers::pi / 180};
  const int frames = static_cast<int>(cast.scene.frame_ids.size());
  return options.turn
             ? turntable_cameras(all, view, frames, options.picture.width, options.picture.height,
                                 options.picture.framing)
             : std::vector<Camera>{camera_around(all, view, options.picture.width,
                                                 options.picture.height, options.picture.framing)};
}

/// Frames a second at which the sequences are played, 0 where none says it. Throws DataError where
/// two say another: frames of one number are then of other moments.
double rate_of(const Cast& cast) {
  double rate = 0;
  for (std::size_t i = 0; i < cast.sequences.size(); ++i) {
    const double own = cast.sequences[i].fps;
    constexpr double kSame = 1e-6;  // of it
    if (own > 0 && rate > 0 && std::abs(own - rate) > kSame * rate) {
      char found[60];
      std::snprintf(found, sizeof found, "%g frames a second", own);
      char expected[60];
      std::snprintf(expected, sizeof expected, "%g, as those before them", rate);
      throw DataError("", "meshes of " + cast.scene.layers[i].name, found, expected);
    }
    rate = own > 0 ? own : rate;
  }
  return rate;
}

/// How a video is played: as fast as its meshes say, unless it was said otherwise.
VideoOptions video_options(const OptionSet& set, double rate) {
  VideoOptions video = options_of<DrawOptions>(set).video;
  for (const OptionField& field : set.table.fields) {
    if (field.name == "video.fps" && field.source == "default" && rate > 0) {
      video.fps = std::clamp(rate, field.min, field.max);
    }
  }
  return video;
}

/// Options that the kind of output leaves without effect.
void require_use(const DrawOptions& options, const OptionTable& table, bool video) {
  for (const OptionField& field : table.fields) {
    if (field.source == "default") {
      continue;
    }
    if (field.name.starts_with("video.") && !video) {
      throw UsageError(flag_of(field.name) + " is of a video; name --out T.mp4, or leave it out");
    }
    if (options.normals && (field.name == "device" || field.name.starts_with("occlusion."))) {
      throw UsageError(flag_of(field.name) +
                       " is of networks and does nothing with --normals; leave one of them out");
    }
    if (field.name == "background" && options.paint.alpha) {
      throw UsageError("--background does nothing with --alpha; leave one of them out");
    }
  }
}

/// Refuses options that place the camera round the subject beside a capture's camera: they would do
/// nothing.
void require_use(const DrawArguments& arguments, const OptionTable& table) {
  static const std::set<std::string> placing = {"azimuth", "elevation", "turn", "width", "height"};
  for (const OptionField& field : table.fields) {
    if (!arguments.capture.empty() && field.source != "default" &&
        (placing.contains(field.name) || field.name.starts_with("framing."))) {
      throw UsageError(flag_of(field.name) +
                       " does nothing: the camera of --capture is used; leave one of them out");
    }
  }
}

/// What images of the workspace say of themselves. Refuses one of people who have not consented to
/// the use: throws ConsentRefused.
RenderStatement statement_of(const fs::path& workspace, const DrawOptions& options) {
  RenderStatement statement;
  statement.purpose = options.use.purpose;
  statement.drawn = options.normals ? kDrawnNormals : kDrawnByNetworks;
  statement.tool = drawing_tool();
  for (const StageStatus& status : workspace_status(all_stages(), workspace)) {
    add_consent(statement.consent, consent_of(status));
    if (status.manifest) {
      statement.made_of.emplace_back(status.stage, hex(outputs_digest(*status.manifest)));
    }
  }
  for (const std::string& doubt : require_consent(statement.consent, options.use)) {
    std::cout << "warning: " << printable(doubt) << std::endl;
  }
  return statement;
}

int run(DrawArguments arguments, const OptionSet& set) {
  const auto& options = options_of<DrawOptions>(set);
  if (arguments.workspace.empty() || arguments.out.empty()) {
    throw UsageError(
        "render --neural takes a WORKSPACE and --out: atelier render --neural WORKSPACE --out "
        "FOLDER");
  }
  if (arguments.camera.empty() != arguments.capture.empty()) {
    throw UsageError("--capture and --camera go together: the camera ID of the capture CAPTURE");
  }
  if (options.networks == "oracle") {
    if (arguments.capture.empty()) {
      throw UsageError(
          "--networks oracle renders the ground truth of a synthetic capture: give --capture and "
          "--camera");
    }
    if (!arguments.body.empty() || !arguments.garments.empty()) {
      throw UsageError(
          "--body and --garment do nothing: --networks oracle renders the ground truth of "
          "--capture; leave them out");
    }
  }
  require_use(arguments, set.table);
  if (options.paint.background.size() != 3) {
    throw UsageError("--background takes three numbers, as in [0.9, 0.9, 0.9]");
  }
  const std::string extension = lower_extension(arguments.out);
  const bool video = extension == ".mp4";
  static const std::set<std::string> other_kinds = {".avi", ".gif", ".jpg", ".m4v",
                                                    ".mkv", ".mov", ".png", ".webm"};
  if (other_kinds.contains(extension)) {
    throw UsageError("--out takes a folder or a video .mp4, not '" + extension + "'");
  }
  if (video && options.paint.alpha) {
    throw UsageError("a video has no alpha channel: leave out --alpha, or choose a folder");
  }
  require_use(options, set.table, video);
  if (!options.mark && !arguments.signing_key.empty()) {
    throw UsageError("--sign does nothing with --mark false; leave one of them out");
  }
  const OpenedWorkspace opened(arguments.workspace, arguments.keys);
  arguments.workspace = opened.path();
  catch_interrupts();
  require_new_place(arguments.out, "--out");
  require_outside_results(arguments.out, arguments.workspace, all_stages(), "--out");
  if (is_inside(arguments.out, arguments.workspace)) {
    throw UsageError("--out lies in the WORKSPACE; choose a path outside of it");
  }
  video ? require_file_place(arguments.out) : require_folder_place(arguments.out);
  const std::optional<Camera> captured = captured_camera(arguments, options);
  Cast cast = whole_cast(arguments, options);
  RenderStatement statement = statement_of(arguments.workspace, options);
  for (const std::string& one : outdated_results(arguments.workspace, {options.networks})) {
    std::cout << "warning: " << printable(one) << std::endl;
  }
  const VideoOptions video_as = video_options(set, rate_of(cast));
  cast.scene.cameras = captured ? std::vector{*captured} : cameras_round(cast, options);
  const std::string mark =
      options.mark ? "mark " + mark_text(mark_of(statement)) : "without a mark";
  std::optional<SignedRender> render;
  if (options.mark) {
    render.emplace(signed_render(std::move(statement), arguments.signing_key,
                                 [] { return passphrase_of("", false); }));
  }
  std::optional<UnfinishedFolder> folder;  // a killed run leaves nothing at the place of --out
  std::optional<VideoWriter> writer;
  if (video) {
    writer.emplace(arguments.out, video_as);
  } else {
    folder.emplace(arguments.out);
    make_private_directory(folder->content());
  }
  PaintHooks hooks;
  hooks.stop = [] { return interrupted(); };
  hooks.picture = [&](Index i, const Image& picture) {
    const std::string name = frame_name(cast.scene.frame_ids[static_cast<std::size_t>(i)]);
    if (video) {
      const Image frame = before_black(picture);
      render ? writer->add(render->marked(frame)) : writer->add(frame);
    } else if (render) {
      render->write_png(folder->content() / (name + ".png"), straight_alpha(picture));
    } else {
      write_image(folder->content() / (name + ".png"), straight_alpha(picture));
    }
    std::cout << "frame " << name << std::endl;
  };
  const bool drawn = options.normals
                         ? draw_normals(cast.scene, options.paint, hooks)
                         : paint_scene(cast.scene, options.paint, options.device, hooks);
  if (!drawn) {
    writer.reset();  // end_by_signal leaves no scope
    folder.reset();
    end_by_signal();
  }
  opened.log("render --neural", arguments.out + ", for " + options.use.purpose + ", " + mark);
  if (writer) {
    render ? writer->finish([&](const fs::path& film) { return render->film_credentials(film); })
           : writer->finish();
  } else {
    folder->finish();
  }
  return kExitDone;
}

}  // namespace

OptionSet draw_options() {
  return option_set<DrawOptions>();
}

Action add_draw(CLI::App& parser) {
  auto arguments = std::make_shared<DrawArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace,
             "Workspace with the networks, or a sealed one")
      .required();
  add_option(parser, "--out", arguments->out,
             "New folder for images (000012.png ...), or a new video (.mp4)")
      .type_name("FOLDER|VIDEO")
      .required();
  add_option(parser, "--body", arguments->body,
             "Meshes of the body, one for each frame [those of the stage body]")
      .type_name("MESHES");
  add_option(parser, "--garment", arguments->garments,
             "Meshes of a garment with the faces of its template [those of the stage register]")
      .type_name("NAME=MESHES")
      .once_a_flag();
  add_option(parser, "--capture", arguments->capture,
             "Capture whose camera is used [a camera around the subject]")
      .type_name("CAPTURE");
  add_option(parser, "--camera", arguments->camera, "Camera of --capture").type_name("ID");
  add_option(parser, "--sign", arguments->signing_key,
             "Secret key by which images are signed, as atelier key --signing writes it [one that "
             "everybody can derive, which says that they are whole, not whose]")
      .type_name("FILE");
  add_key_arguments(parser, arguments->keys);
  const OptionReader options = add_option_flags(parser, draw_options());
  return [arguments, options] { return run(*arguments, options()); };
}

}  // namespace atelier
