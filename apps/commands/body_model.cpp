#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/standard_streams.h"
#include "bodymodel/body_pieces.h"
#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/input/body_input.h"
#include "bodymodel/measure.h"
#include "bodymodel/missing_frames.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/image_file.h"
#include "core/io/json_text.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/scene_file.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/render/contact_sheet.h"
#include "core/render/framing.h"
#include "core/render/scaled_pictures.h"
#include "core/render/studio.h"
#include "core/render/tone.h"
#include "core/render/video.h"
#include "core/store/keep_rights.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/pictures/picture_names.h"
#include "pipeline/pictures/picture_size.h"

namespace atelier {
namespace {

constexpr double kMinRate = 0.1;  // frames a second

/// Text arguments of `atelier body-model`.
struct BodyArguments : BodySource {
  std::string action;
  std::string motion;
  std::string out;
  std::string as;  ///< convert: "body", "motion" or "": what the file holds
  bool json = false;
};

struct BodyOptions : BodyInputOptions {
  std::string asf;  ///< skeleton of an .amc; "": the .asf beside it
  MotionOptions motion;
  MarkerFitOptions markers;
  RetargetOptions retarget;
  int pictures = 12;
  PictureOptions picture{.width = 360, .height = 540, .samples = 8, .framing = {}};
};

OptionTable describe(BodyOptions& options) {
  OptionTable table;
  table.add("four_influences", options.four_influences,
            "Limit of four joints that influence a vertex, for viewers and game engines");
  table.add("metres_per_unit", options.metres_per_unit, 1e-6, 1e6, "m",
            "Length of the unit of a glTF, FBX or SMPL-family body; 0.01 where it is in "
            "centimetres and says metres");
  table.add("rig", options.rig, {},
            "MakeHuman rig, .mhskel or MPFB2's rig.*.json; empty: the one beside the body");
  table.add("weights", options.weights, {},
            "MakeHuman skinning weights, .mhw or weights.*.json; empty: those beside the body");
  table.add("macros", describe(options.macros));
  table.add("asf", options.asf, {}, "Skeleton (.asf) of an .amc motion; empty: the one beside it");
  table.add("motion", describe(options.motion));
  table.add("markers", describe(options.markers));
  table.add("retarget", describe(options.retarget));
  table.add("pictures", options.pictures, 1, 400, "",
            "Number of poses on the contact sheet of pose");
  return table.add(describe(options.picture));
}

/// Every finding as a line on standard error.
void show_findings(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    standard_error() << printable(to_string(finding)) << "\n";
  }
}

Mesh shown(const BodyModel& model, Points vertices) {
  Mesh mesh;
  mesh.vertices = std::move(vertices);
  mesh.faces = model.mesh.faces;
  return mesh;
}

int show(const BodyArguments& arguments, const BodyOptions& options) {
  if (!image_format_of_name(arguments.out)) {
    throw UsageError("--out cannot be '" + arguments.out.substr(0, 80) +
                     "': show takes a name with " + kPictureNames);
  }
  require_picture_size(options.picture, 4);
  const auto [model, shape] = read_body_input(arguments, options, show_findings);
  const Mesh mesh = shown(model, shape_body(model, shape).vertices);
  // From one distance, so that the images have one scale.
  const std::vector<Camera> cameras =
      turntable_cameras(mesh.vertices, kFront, 4, options.picture.width, options.picture.height,
                        options.picture.framing);
  const PreparedScene scene = prepare(studio_scene({{mesh, clay_look()}}));
  RenderOptions render_options;
  render_options.samples = options.picture.samples;
  const char* captions[4] = {"front", "left", "back", "right"};
  std::vector<CaptionedImage> pictures;
  for (std::size_t side = 0; side < 4; ++side) {
    pictures.push_back({tone_mapped(render(scene, cameras[side], render_options)), captions[side]});
  }
  ContactSheetOptions sheet;
  sheet.columns = 4;
  sheet.title = model.name + ": " + std::to_string(vertex_count(model)) + " vertices, " +
                std::to_string(joint_count(model)) + " joints, " +
                std::to_string(model.shape.size()) + " shape parameters";
  write_image(arguments.out, contact_sheet(pictures, sheet));
  std::cout << printable(arguments.out) << ": " << sheet.title << "\n";
  return kExitDone;
}

// Errors of measuring know no file.
BodyMeasurements measured(const BodyModel& model, const Eigen::VectorXd& shape,
                          const std::string& file) {
  try {
    return measure_body(model, shape);
  } catch (const DataError& error) {
    throw DataError(error.file.empty() ? file : error.file, error.where, error.found,
                    error.expected);
  }
}

int measure(const BodyArguments& arguments, const BodyOptions& options) {
  auto [model, shape] = read_body_input(arguments, options, show_findings);
  model.skeleton =
      with_smpl_names(model.skeleton, recognised_humanoid(model.skeleton, arguments.body));
  if (find_joint(model.skeleton, "neck") < 0) {
    throw DataError(arguments.body, "skeleton", "no joint between chest and head",
                    "a neck, which lengths and girths are measured from");
  }
  const int pieces = main_piece(model.mesh.vertices, model.mesh.faces).pieces;
  if (pieces > 1) {
    show_findings(
        {{Severity::Warning, "measure-pieces", arguments.body,
          std::to_string(pieces) + " pieces of skin, none with four fifths of the volume",
          "all are measured as one, without mass: take a body without clothes and hair"}});
  }
  const BodyMeasurements found = measured(model, shape, arguments.body);
  nlohmann::ordered_json json;
  for (const NamedMeasurement& row : measurement_names()) {
    const double value = found.*row.value;
    if (value == 0) {
      continue;  // not to be had of this body
    }
    if (arguments.json) {
      json[row.name] = {{"value", value}, {"unit", row.unit}};
    } else {
      char line[160];
      std::snprintf(line, sizeof line, "%-18s %8.3f %s\n", row.name.c_str(), value,
                    row.unit.c_str());
      std::cout << line;
    }
  }
  if (arguments.json) {
    std::cout << json_text(json, 2) << "\n";
  }
  return kExitDone;
}

bool is_gltf(const std::string& extension) {
  return extension == ".glb" || extension == ".gltf";
}

// Whether convert takes a file for a motion: as --as says or, without it, as the file holds.
bool converts_motion(const BodyArguments& arguments) {
  return arguments.as.empty() ? holds_motion(arguments.body) : arguments.as == "motion";
}

int convert_motion(const BodyArguments& arguments, const BodyOptions& options) {
  const std::string extension = lower_extension(arguments.out);
  if (extension != ".bvh" && extension != ".trc" && extension != ".npz" && !is_gltf(extension)) {
    throw UsageError(
        "--out cannot be '" + arguments.out.substr(0, 80) +
        "': a motion becomes .bvh, .trc, .npz, .glb or .gltf; body-model pose puts it on a "
        "body");
  }
  MotionClip clip = read_motion_file(arguments.body, {.motion = options.motion,
                                                      .asf = options.asf,
                                                      .markers = options.markers,
                                                      .body = nullptr,
                                                      .shape = {}});
  fill_missing_frames(clip, arguments.body);
  show_findings(clip.findings);
  if (is_gltf(extension)) {
    GltfScene scene = gltf_motion(clip);
    keep_rights({arguments.body}, scene);
    write_gltf(arguments.out, scene);
  } else {
    write_motion_file(arguments.out, clip);
  }
  std::cout << printable(arguments.out) << ": " << clip.skeleton.names.size() << " joints, "
            << counted(static_cast<std::int64_t>(clip.motion.poses.size()), "frame") << " at "
            << short_number(clip.motion.fps) << " per second\n";
  return kExitDone;
}

void say_what_gltf_lacks(const BodyModel& model, const std::string& file) {
  if (model.shape.empty() && model.correctives.empty()) {
    return;
  }
  show_findings({{Severity::Note, "gltf-left-out", file,
                  "glTF has no place for " + counted(std::ssize(model.shape), "shape parameter") +
                      " and " + counted(std::ssize(model.correctives), "pose corrective"),
                  "the body is written at its shape, without them; .npz holds all"}});
}

int convert_body(const BodyArguments& arguments, const BodyOptions& options) {
  const std::string extension = lower_extension(arguments.out);
  if (extension == ".bvh" || extension == ".trc") {
    throw UsageError(
        "--out cannot be '" + arguments.out.substr(0, 80) + "': " + arguments.body +
        " is a body: it becomes .npz, .glb, .gltf, .obj or .ply; body-model pose BODY MOTION "
        "--out a" +
        extension + " writes a motion on its skeleton" +
        (has_scene_extension(arguments.body) ? "; --as motion takes the file's own" : ""));
  }
  if (extension != ".npz" && !is_gltf(extension) && extension != ".obj" && extension != ".ply") {
    throw UsageError("--out cannot be '" + arguments.out.substr(0, 80) +
                     "': convert takes a name with .npz, .glb, .gltf, .obj or .ply for a body, "
                     ".bvh, .trc, .npz, .glb or .gltf for a motion");
  }
  const auto [model, shape] = read_body_input(arguments, options, show_findings);
  if (extension == ".npz") {
    write_body(arguments.out, at_shape(model, shape));
  } else if (is_gltf(extension)) {
    GltfScene scene = gltf_body(model, shape);
    keep_rights({arguments.body}, scene);
    write_gltf(arguments.out, scene);
    say_what_gltf_lacks(model, arguments.out);
  } else {
    Mesh mesh = model.mesh;
    mesh.vertices = shape_body(model, shape).vertices;
    mesh.normals.resize(0, 3);
    write_mesh(arguments.out, mesh);
  }
  std::cout << printable(arguments.out) << ": "
            << (is_gltf(extension) ? gltf_vertex_count(model.mesh) : vertex_count(model))
            << " vertices, ";
  if (extension == ".obj" || extension == ".ply") {
    std::cout << model.mesh.faces.rows() << " triangles\n";
  } else {
    std::cout << joint_count(model) << " joints\n";
  }
  return kExitDone;
}

int convert(const BodyArguments& arguments, const BodyOptions& options) {
  return converts_motion(arguments) ? convert_motion(arguments, options)
                                    : convert_body(arguments, options);
}

/// Everything that a posed body passes through, so that a camera sees it all.
Points path_of(const BodyModel& model, const ShapedBody& body, const Motion& motion) {
  const Index frames = static_cast<Index>(motion.poses.size());
  const Index step = std::max<Index>(1, frames / 40);
  Points all(0, 3);
  for (Index frame = 0; frame < frames; frame += step) {
    const Points posed = skin_vertices(model, body, motion.poses[static_cast<std::size_t>(frame)]);
    const Index rows = all.rows();
    all.conservativeResize(rows + 2, 3);
    all.row(rows) = posed.colwise().minCoeff();
    all.row(rows + 1) = posed.colwise().maxCoeff();
  }
  return all;
}

int pose(const BodyArguments& arguments, const BodyOptions& options) {
  const std::string extension = lower_extension(arguments.out);
  const bool sheet_wanted = image_format_of_name(arguments.out).has_value();
  if (!sheet_wanted && extension != ".mp4" && extension != ".glb" && extension != ".gltf" &&
      extension != ".bvh" && extension != ".trc" && extension != ".npz") {
    throw UsageError(
        "--out cannot be '" + arguments.out.substr(0, 80) +
        "': pose takes a name with .mp4, .glb, .gltf, .bvh, .trc, .npz or, for a contact sheet, " +
        kPictureNames);
  }
  require_picture_size(options.picture, sheet_wanted ? options.pictures : 1);
  const auto [read_model, shape] = read_body_input(arguments, options, show_findings);
  const BodyModel& model = read_model;  // lambdas take no structured bindings
  MotionClip clip = read_motion_file(arguments.motion, {.motion = options.motion,
                                                        .asf = options.asf,
                                                        .markers = options.markers,
                                                        .body = &model,
                                                        .shape = shape});
  fill_missing_frames(clip, arguments.motion);
  show_findings(clip.findings);
  RetargetOptions retargeting = options.retarget;
  if (extension == ".mp4" && retargeting.fps == 0) {
    retargeting.fps = 30;
  }
  const Retargeted moved = retarget(clip, model, shape, retargeting);
  show_findings(moved.findings);
  const ShapedBody body = shape_body(model, shape);
  const Motion& motion = moved.motion;
  const Index frames = static_cast<Index>(motion.poses.size());
  const auto posed = [&](Index frame) {
    return shown(model, skin_vertices(model, body, motion.poses[static_cast<std::size_t>(frame)]));
  };
  if (sheet_wanted) {
    std::vector<CaptionedImage> tiles;
    std::vector<Mesh> meshes;
    const Index count = std::min<Index>(options.pictures, frames);
    for (Index i = 0; i < count; ++i) {
      const Index frame = count > 1 ? i * (frames - 1) / (count - 1) : 0;
      meshes.push_back(posed(frame));
      tiles.push_back(
          {{}, "frame " + std::to_string(motion.frame_ids[static_cast<std::size_t>(frame)])});
    }
    const std::vector<Image> pictures =
        pictures_at_one_scale(meshes, kThreeQuarter, options.picture);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      tiles[i].image = pictures[i];
    }
    ContactSheetOptions sheet;
    sheet.columns = std::min(6, static_cast<int>(count));
    sheet.title = clip.name + " on " + model.name;
    write_image(arguments.out, contact_sheet(tiles, sheet));
  } else if (extension == ".mp4") {
    const Camera camera =
        camera_around(path_of(model, body, motion), kThreeQuarter, options.picture.width,
                      options.picture.height, options.picture.framing);
    VideoOptions video;
    video.fps = motion.fps;
    RenderOptions render_options;
    render_options.samples = options.picture.samples;
    write_video(
        arguments.out, frames,
        [&](Index frame) {
          Mesh mesh = posed(frame);
          Scene scene = studio_scene({{std::move(mesh), clay_look()}});
          if (scene.ground) {
            scene.ground->height = 0;  // a jump leaves the ground
          }
          PrepareOptions prepared;
          prepared.ambient = Ambient::PerVertex;
          prepared.vertex_samples = 32;
          return tone_mapped(render(prepare(scene, prepared), camera, render_options));
        },
        video);
  } else if (extension == ".bvh" || extension == ".trc" || extension == ".npz") {
    MotionClip result;
    result.name = clip.name;
    result.skeleton = body.skeleton;
    result.motion = motion;
    write_motion_file(arguments.out, result);
  } else {
    GltfScene scene = gltf_body(model, shape, motion);
    keep_rights({arguments.body, arguments.motion}, scene);
    write_gltf(arguments.out, scene);
    say_what_gltf_lacks(model, arguments.out);
  }
  std::cout << printable(arguments.out) << ": " << counted(frames, "frame") << " at "
            << short_number(motion.fps) << " per second, steps scaled by "
            << short_number(moved.scale) << "\n";
  return kExitDone;
}

// The use of a flag, "" where it has its effect here.
std::string use_of(const std::string& flag, const BodyArguments& arguments) {
  const bool poses = arguments.action == "pose";
  const bool motion = poses || (arguments.action == "convert" && converts_motion(arguments));
  const bool body = poses || !motion;
  const std::string moved = poses ? arguments.motion : arguments.body;
  const std::string extension = lower_extension(arguments.out);
  const auto belongs = [&](const std::string& section) {
    return flag == section || flag.starts_with(section + ".");
  };
  if (flag == "four_influences") {
    return body ? "" : "is for bodies";
  }
  if (flag == "metres_per_unit") {
    const std::string from = lower_extension(arguments.body);
    const bool scaled = body && (has_scene_extension(arguments.body) || from == ".npz");
    return scaled ? ""
                  : "is for bodies in .glb, .gltf, .fbx and .npz; motions have --motion." + flag;
  }
  if (belongs("macros") || flag == "rig" || flag == "weights") {
    const std::string instead = is_generated_body(arguments.body)
                                    ? "; " + arguments.body + " takes --shape stature=1.8,mass=70"
                                    : "";
    return is_makehuman_body(arguments.body) ? "" : "is for MakeHuman's base.obj" + instead;
  }
  if (belongs("motion")) {
    return motion ? "" : "is for a motion";
  }
  if (belongs("asf")) {
    return motion && lower_extension(moved) == ".amc" ? "" : "is for a motion in an .amc";
  }
  if (belongs("markers")) {
    const std::string from = lower_extension(moved);
    return motion && (from == ".trc" || from == ".c3d") ? "" : "is for markers in a .trc or .c3d";
  }
  if (belongs("retarget")) {
    return poses ? "" : "is for pose";
  }
  const bool picture = image_format_of_name(arguments.out).has_value();
  if (flag == "pictures") {
    return poses && picture ? "" : "is for pose with a contact sheet as --out";
  }
  return picture || extension == ".mp4" ? "" : "is for images and videos";
}

// A flag that changes nothing is a mistake of who gave it. A file of options may serve several
// commands.
void refuse_flags_without_effect(const BodyArguments& arguments, const OptionTable& table) {
  for (const OptionField& field : table.fields) {
    const std::string use = field.source == "flag" ? use_of(field.name, arguments) : "";
    if (!use.empty()) {
      throw UsageError(flag_of(field.name) + " has no effect here: it " + use);
    }
  }
  if (arguments.json && arguments.action != "measure") {
    throw UsageError("--json has no effect here: it is for measure");
  }
  if (!arguments.out.empty() && arguments.action == "measure") {
    throw UsageError("--out has no effect here: measure prints, as JSON with --json");
  }
  if (!arguments.as.empty() && arguments.action != "convert") {
    throw UsageError("--as has no effect here: it is for convert");
  }
  if (!arguments.target.empty() && !is_makehuman_body(arguments.body)) {
    throw UsageError("--target has no effect here: it is for MakeHuman's base.obj");
  }
  if (!arguments.shape.empty() && arguments.action == "convert" && converts_motion(arguments)) {
    throw UsageError("--shape has no effect here: it is for bodies, and " + arguments.body +
                     " is a motion");
  }
}

// Slower than a frame in ten seconds is no motion: a typing error, and no video takes it.
void require_frame_rate(const char* name, double fps) {
  if (fps != 0 && fps < kMinRate) {
    throw UsageError(std::string(name) + " cannot be " + short_number(fps) + ": it takes 0 or " +
                     short_number(kMinRate) + " to 1000 (1/s)");
  }
}

// A body and a motion in each other's place.
void refuse_the_other_kind(const BodyArguments& arguments) {
  if (arguments.action != "convert" && holds_motion(arguments.body)) {
    throw DataError(arguments.body, "file", "this is a motion, not a body",
                    "a body" + std::string(arguments.action == "pose" ? ", then the motion" : ""));
  }
  if (arguments.action == "pose" && holds_body(arguments.motion)) {
    throw DataError(arguments.motion, "file", "this is a body, not a motion",
                    "a motion: .bvh, .amc, .trc, .c3d, .npz, .glb, .gltf or .fbx");
  }
}

int run(const BodyArguments& arguments, const OptionTable& given, const BodyOptions& options) {
  const bool poses = arguments.action == "pose";
  if (arguments.action.empty() || arguments.body.empty()) {
    throw UsageError(
        "body-model takes an ACTION (show, measure, convert, pose) and a BODY: atelier body-model "
        "show default --out body.png");
  }
  if (poses == arguments.motion.empty()) {
    throw UsageError(
        poses ? "body-model pose takes a MOTION: atelier body-model pose BODY MOTION --out walk.png"
              : "body-model " + arguments.action + " takes no MOTION: only pose takes a motion");
  }
  if (arguments.out.empty() && arguments.action != "measure") {
    throw UsageError("body-model " + arguments.action +
                     " takes --out FILE; its extension says what "
                     "is written");
  }
  refuse_flags_without_effect(arguments, given);
  require_frame_rate("motion.fps", options.motion.fps);
  require_frame_rate("retarget.fps", options.retarget.fps);
  if (!arguments.out.empty()) {
    require_file_place(arguments.out);
  }
  refuse_the_other_kind(arguments);
  if (poses) {
    return pose(arguments, options);
  }
  return arguments.action == "show"      ? show(arguments, options)
         : arguments.action == "measure" ? measure(arguments, options)
                                         : convert(arguments, options);
}

constexpr const char* kBodyHelp =
    "default, female, male, .npz (ours, SMPL, SMPL-H, SMPL-X, STAR), .glb, .gltf, .fbx, or "
    "MakeHuman's base.obj or its folder";

}  // namespace

OptionSet body_model_options() {
  return option_set<BodyOptions>();
}

Action add_body_model(CLI::App& parser) {
  auto arguments = std::make_shared<BodyArguments>();
  BodyArguments& a = *arguments;
  add_option(parser, "ACTION", a.action,
             "show: images from four sides; measure: lengths, girths, mass; convert: a body to "
             ".npz, .glb, .gltf, .obj, .ply, a motion to .bvh, .trc, .npz, .glb, .gltf; pose: a "
             "motion on a body as contact sheet, video, .glb, .gltf, .bvh, .trc or .npz")
      .check(one_of({"show", "measure", "convert", "pose"}))
      .type_name("show|measure|convert|pose");
  add_option(parser, "BODY", a.body, kBodyHelp);
  add_option(parser, "MOTION", a.motion,
             "Motion for pose: .bvh, .amc, .trc, .c3d, .npz (ours, AMASS), .glb, .gltf, .fbx");
  add_option(parser, "--out", a.out, "File to write; its extension selects the format")
      .type_name("FILE");
  add_option(parser, "--as", a.as, "convert: part of a glTF or FBX file that holds both [body]")
      .check(one_of({"body", "motion"}))
      .type_name("body|motion");
  add_option(parser, "--target", a.target,
             "MakeHuman: a .target file and its weight, 0 to 1; once for each")
      .once_a_flag()
      .type_name("FILE=WEIGHT");
  add_option(parser, "--shape", a.shape,
             "Shape parameters in their own units: stature=1.8; of default, female and male also a "
             "file of measurements by Valentina or Seamly2D (.vit, .smis)")
      .delimiter(',')
      .once_a_flag()
      .type_name("NAME=VALUE,...|FILE");
  add_flag(parser, "--json", a.json, "measure: output as JSON");
  const OptionReader options = add_option_flags(parser, body_model_options());
  return [arguments, options] {
    const OptionSet given = options();
    return run(*arguments, given.table, options_of<BodyOptions>(given));
  };
}

}  // namespace atelier
