#ifdef ATELIER_HAS_BODYMODEL
#ifdef ATELIER_HAS_CORE_RENDER

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <variant>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/option_flags.h"
#include "apps/output_place.h"
#include "apps/picture_names.h"
#include "apps/picture_size.h"
#include "apps/usage_error.h"
#include "bodymodel/body_archive.h"
#include "bodymodel/body_file.h"
#include "bodymodel/default_human.h"
#include "bodymodel/gltf_body.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/measure.h"
#include "bodymodel/motion_file.h"
#include "bodymodel/retarget.h"
#include "bodymodel/skin_weights.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/framing.h"
#include "core/render/studio.h"
#include "core/render/tone.h"
#include "core/render/video.h"

namespace atelier {
namespace {

struct BodyArguments {
  std::string action;
  std::string body;
  std::string motion;
  std::string out;
  std::vector<std::string> shape;  ///< name=value
  bool json = false;
};

struct BodyOptions {
  MakeHumanMacros macros;
  std::string rig;      ///< of a MakeHuman body; "": the one beside it
  std::string weights;  ///< of a MakeHuman body; "": those beside it
  std::string asf;      ///< skeleton of an .amc; "": the .asf beside it
  MotionOptions motion;
  MarkerFitOptions markers;
  RetargetOptions retarget;
  bool four_influences = false;
  int pictures = 12;
  PictureOptions picture{.width = 360, .height = 540, .samples = 8, .framing = {}};
};

OptionTable describe(BodyOptions& options) {
  OptionTable table;
  table.add("four_influences", options.four_influences,
            "Keep four joints a vertex, as viewers and game engines expect");
  table.add("rig", options.rig, {},
            "MakeHuman: .mhskel or MPFB2 rig.*.json; none: beside the body");
  table.add("weights", options.weights, {},
            "MakeHuman: .mhw or weights.*.json; none: beside the body");
  table.add("macros", describe(options.macros));
  table.add("asf", options.asf, {}, "Skeleton of an .amc; none: the .asf beside it");
  table.add("motion", describe(options.motion));
  table.add("markers", describe(options.markers));
  table.add("retarget", describe(options.retarget));
  table.add("pictures", options.pictures, 1, 400, "", "pose: how many the contact sheet has");
  return table.add(describe(options.picture));
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void print(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    std::cerr << to_string(finding) << "\n";
  }
}

std::pair<std::string, double> assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text.substr(equals == std::string::npos ? text.size() : equals + 1), &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (equals == std::string::npos || used == 0 || equals + 1 + used != text.size()) {
    throw UsageError("'" + text.substr(0, 80) + "' is no NAME=NUMBER");
  }
  return {text.substr(0, equals), value};
}

bool is_generated(const BodyArguments& arguments) {
  return arguments.body == "default" || arguments.body == "female" || arguments.body == "male";
}

// The default human is made anew with the measures asked for, so that what is not asked for follows
// from them; nothing for other bodies.
std::optional<BodyModel> generated(const BodyArguments& arguments) {
  if (!is_generated(arguments)) {
    return std::nullopt;
  }
  DefaultHumanOptions human = arguments.body == "female" ? female_human()
                              : arguments.body == "male" ? male_human()
                                                         : DefaultHumanOptions{};
  OptionTable table = describe(human);
  for (const std::string& text : arguments.shape) {
    const auto [name, value] = assignment(text);
    std::string known;
    bool found = false;
    for (const OptionField& field : table.fields) {
      if (std::holds_alternative<double*>(field.target)) {
        known += (known.empty() ? "" : ", ") + field.name;
        found = found || field.name == name;
      }
    }
    if (!found) {
      throw UsageError("the body has no shape parameter '" + name.substr(0, 80) + "'; it has " +
                       known);
    }
    const std::string problem = set_option(table, name, text.substr(text.find('=') + 1));
    if (!problem.empty()) {
      throw UsageError(problem);
    }
  }
  const std::string problem = human_options_problem(human);
  if (!problem.empty()) {
    throw UsageError(problem);
  }
  return default_human(human);
}

BodyModel read(const BodyArguments& arguments, const BodyOptions& options) {
  const MakeHumanMacros& macros = options.macros;
  const double shares = macros.african + macros.asian + macros.caucasian;
  if (!(std::abs(shares - 1) <= 1e-6)) {
    throw UsageError("macros.african, macros.asian and macros.caucasian add up to " +
                     number(shares) + ": they are shares of 1");
  }
  BodyFileOptions files;
  files.makehuman.macros = macros;
  files.rig = options.rig;
  files.weights = options.weights;
  std::optional<BodyModel> human = generated(arguments);
  BodyFile body = human ? BodyFile{std::move(*human), {}} : read_body_file(arguments.body, files);
  print(body.findings);
  if (options.four_influences) {
    SkinPackOptions pack;
    pack.max_slots = 4;
    body.model.skin =
        repair_skin_weights(body.model.skin, joint_count(body.model), pack, arguments.body).skin;
  }
  return std::move(body.model);
}

Eigen::VectorXd shape_of(const BodyArguments& arguments, const BodyModel& model) {
  Eigen::VectorXd shape = neutral_shape(model);
  if (is_generated(arguments)) {
    return shape;  // it was made with the measures asked for
  }
  for (const std::string& text : arguments.shape) {
    const auto [name, value] = assignment(text);
    const int index = find_shape(model, name);
    if (index < 0) {
      std::string known;
      for (const ShapeParameter& parameter : model.shape) {
        known += (known.empty() ? "" : ", ") + parameter.name;
      }
      throw UsageError("the body has no shape parameter '" + name.substr(0, 80) + "'; it has " +
                       (known.empty() ? "none" : known));
    }
    const ShapeParameter& parameter = model.shape[static_cast<std::size_t>(index)];
    if (!(value >= parameter.min && value <= parameter.max)) {
      throw UsageError(name + " cannot be " + number(value) + ": it is in [" +
                       number(parameter.min) + ", " + number(parameter.max) + "] " +
                       parameter.unit);
    }
    shape[index] = value;
  }
  return shape;
}

Mesh shown(const BodyModel& model, Points vertices) {
  Mesh mesh;
  mesh.vertices = std::move(vertices);
  mesh.faces = model.mesh.faces;
  return mesh;
}

int show(const BodyArguments& arguments, const BodyOptions& options) {
  if (!image_format_of_name(arguments.out)) {
    throw UsageError("--out takes a name with " + std::string(kPictureNames));
  }
  require_picture_size(options.picture, 4);
  const BodyModel model = read(arguments, options);
  const Mesh mesh = shown(model, shape_body(model, shape_of(arguments, model)).vertices);
  // From one distance, so that the pictures have one scale.
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
  std::cout << arguments.out << ": " << sheet.title << "\n";
  return kExitDone;
}

int measure(const BodyArguments& arguments, const BodyOptions& options) {
  BodyModel model = read(arguments, options);
  model.skeleton =
      with_smpl_names(model.skeleton, recognised_humanoid(model.skeleton, arguments.body));
  if (find_joint(model.skeleton, "neck") < 0) {
    throw DataError(arguments.body, "skeleton", "no joint between chest and head",
                    "a neck, which lengths and girths are measured from");
  }
  const BodyMeasurements found = measure_body(model, shape_of(arguments, model));
  nlohmann::ordered_json json;
  for (const NamedMeasurement& row : measurement_names()) {
    const double value = found.*row.value;
    if (arguments.json) {
      json[row.name] = {{"value", value}, {"unit", row.unit}};
    } else {
      std::printf("%-18s %8.3f %s\n", row.name.c_str(), value, row.unit.c_str());
    }
  }
  if (arguments.json) {
    std::cout << json.dump(2) << "\n";
  }
  return kExitDone;
}

int convert(const BodyArguments& arguments, const BodyOptions& options) {
  const std::string extension = lower_extension(arguments.out);
  const std::string from = lower_extension(arguments.body);
  if (from == ".bvh" || from == ".amc" || from == ".trc" || extension == ".bvh") {
    if (extension != ".bvh" && extension != ".npz") {
      throw UsageError("a motion becomes .bvh or .npz; body-model pose puts it on a body");
    }
    const MotionClip clip =
        read_motion_file(arguments.body, options.motion, options.asf, options.markers);
    print(clip.findings);
    write_motion_file(arguments.out, clip);
    std::cout << arguments.out << ": " << clip.skeleton.names.size() << " joints, "
              << clip.motion.poses.size() << " frames at " << number(clip.motion.fps)
              << " per second\n";
    return kExitDone;
  }
  const BodyModel model = read(arguments, options);
  const Eigen::VectorXd shape = shape_of(arguments, model);
  if (extension == ".npz") {
    write_body(arguments.out, model);
  } else if (extension == ".glb" || extension == ".gltf") {
    write_gltf(arguments.out, gltf_body(model, shape));
  } else if (extension == ".obj" || extension == ".ply") {
    Mesh mesh = model.mesh;
    mesh.vertices = shape_body(model, shape).vertices;
    mesh.normals.resize(0, 3);
    write_mesh(arguments.out, mesh);
  } else {
    throw UsageError(
        "--out takes a name with .npz, .glb, .gltf, .obj, .ply (bodies), .bvh or .npz "
        "(motions)");
  }
  std::cout << arguments.out << ": " << vertex_count(model) << " vertices, " << joint_count(model)
            << " joints\n";
  return kExitDone;
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
      extension != ".bvh" && extension != ".npz") {
    throw UsageError(
        "--out takes a name with .mp4, .glb, .gltf, .bvh, .npz or, for a contact sheet, " +
        std::string(kPictureNames));
  }
  require_picture_size(options.picture, sheet_wanted ? options.pictures : 1);
  const BodyModel model = read(arguments, options);
  const Eigen::VectorXd shape = shape_of(arguments, model);
  const MotionClip clip =
      read_motion_file(arguments.motion, options.motion, options.asf, options.markers);
  print(clip.findings);
  RetargetOptions retargeting = options.retarget;
  if (extension == ".mp4" && retargeting.fps == 0) {
    retargeting.fps = 30;
  }
  const Retargeted moved = retarget(clip, model, shape, retargeting);
  print(moved.findings);
  const ShapedBody body = shape_body(model, shape);
  const Motion& motion = moved.motion;
  const Index frames = static_cast<Index>(motion.poses.size());
  const auto posed = [&](Index frame) {
    return shown(model, skin_vertices(model, body, motion.poses[static_cast<std::size_t>(frame)]));
  };
  if (sheet_wanted) {
    std::vector<CaptionedImage> tiles;
    const Index count = std::min<Index>(options.pictures, frames);
    for (Index i = 0; i < count; ++i) {
      const Index frame = count > 1 ? i * (frames - 1) / (count - 1) : 0;
      tiles.push_back(
          {picture_of(posed(frame), kThreeQuarter, options.picture),
           "frame " + std::to_string(motion.frame_ids[static_cast<std::size_t>(frame)])});
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
  } else if (extension == ".bvh" || extension == ".npz") {
    MotionClip result;
    result.name = clip.name;
    result.skeleton = body.skeleton;
    result.motion = motion;
    write_motion_file(arguments.out, result);
  } else {
    write_gltf(arguments.out, gltf_body(model, shape, motion));
  }
  std::cout << arguments.out << ": " << frames << " frames at " << number(motion.fps)
            << " per second, steps scaled by " << number(moved.scale) << "\n";
  return kExitDone;
}

bool is_motion_name(const std::string& name) {
  const std::string extension = lower_extension(name);
  return extension == ".bvh" || extension == ".amc" || extension == ".trc";
}

// What a flag is for, "" where it has its effect here.
std::string use_of(const std::string& flag, const BodyArguments& arguments) {
  const bool poses = arguments.action == "pose";
  const bool motion =
      poses || (arguments.action == "convert" &&
                (is_motion_name(arguments.body) || lower_extension(arguments.out) == ".bvh"));
  const std::string moved = poses ? arguments.motion : arguments.body;
  const std::string extension = lower_extension(arguments.out);
  const auto belongs = [&](const std::string& section) {
    return flag == section || flag.starts_with(section + ".");
  };
  if (flag == "four_influences") {
    return "";
  }
  if (belongs("macros") || flag == "rig" || flag == "weights") {
    const bool makehuman =
        !is_generated(arguments) && (lower_extension(arguments.body) == ".obj" ||
                                     std::filesystem::is_directory(arguments.body));
    const std::string instead =
        is_generated(arguments) ? "; " + arguments.body + " takes --shape stature=1.8,mass=70" : "";
    return makehuman ? "" : "is for MakeHuman's base.obj" + instead;
  }
  if (belongs("motion")) {
    return motion ? "" : "is for a motion";
  }
  if (belongs("asf")) {
    return motion && lower_extension(moved) == ".amc" ? "" : "is for a motion in an .amc";
  }
  if (belongs("markers")) {
    return motion && lower_extension(moved) == ".trc" ? "" : "is for markers in a .trc";
  }
  if (belongs("retarget")) {
    return poses ? "" : "is for pose";
  }
  const bool picture = image_format_of_name(arguments.out).has_value();
  if (flag == "pictures") {
    return poses && picture ? "" : "is for pose with a contact sheet as --out";
  }
  return picture || extension == ".mp4" ? "" : "is for pictures and videos";
}

// A flag that changes nothing is a mistake of who gave it. A file of options may serve several
// commands.
void refuse_flags_without_effect(const BodyArguments& arguments, const OptionTable& table) {
  for (const OptionField& field : table.fields) {
    const std::string use = field.source == "flag" ? use_of(field.name, arguments) : "";
    if (!use.empty()) {
      throw UsageError("--" + field.name + " has no effect here: it " + use);
    }
  }
  if (arguments.json && arguments.action != "measure") {
    throw UsageError("--json has no effect here: it is for measure");
  }
  if (!arguments.out.empty() && arguments.action == "measure") {
    throw UsageError("--out has no effect here: measure prints, as JSON with --json");
  }
  if (!arguments.shape.empty() && is_motion_name(arguments.body)) {
    throw UsageError("--shape has no effect here: it is for bodies, and " + arguments.body +
                     " is a motion");
  }
}

int run(const BodyArguments& arguments, const OptionTable& given, const BodyOptions& options) {
  const bool poses = arguments.action == "pose";
  if (arguments.action.empty() || arguments.body.empty()) {
    throw UsageError(
        "it takes an action and a body: atelier body-model show default --out body.png");
  }
  if (poses == arguments.motion.empty()) {
    throw UsageError(poses ? "it takes a motion: atelier body-model pose BODY MOTION --out walk.png"
                           : "only pose takes a motion");
  }
  if (arguments.out.empty() && arguments.action != "measure") {
    throw UsageError("it takes --out FILE");
  }
  refuse_flags_without_effect(arguments, given);
  if (!arguments.out.empty()) {
    require_file_place(arguments.out);
  }
  if (poses) {
    return pose(arguments, options);
  }
  return arguments.action == "show"      ? show(arguments, options)
         : arguments.action == "measure" ? measure(arguments, options)
                                         : convert(arguments, options);
}

constexpr const char* kBodyHelp =
    "default, female, male, .npz (ours, SMPL, SMPL-H, SMPL-X, STAR), .glb, .gltf, or MakeHuman's "
    "base.obj or its folder";

}  // namespace

OptionSet body_model_options() {
  return option_set<BodyOptions>();
}

Action add_body_model(CLI::App& parser) {
  auto arguments = std::make_shared<BodyArguments>();
  BodyArguments& a = *arguments;
  parser
      .add_option("ACTION", a.action,
                  "show: pictures from four sides; measure: lengths, girths, mass; convert: a body "
                  "into .npz, .glb, .obj, .ply, a motion into .bvh, .npz; pose: a motion on a body "
                  "as contact sheet, video, .glb, .bvh or .npz")
      ->check(one_of({"show", "measure", "convert", "pose"}))
      ->type_name("show|measure|convert|pose");
  parser.add_option("BODY", a.body, kBodyHelp);
  parser.add_option("MOTION", a.motion, "pose: .bvh, .amc, .trc, .npz (ours, AMASS), .glb, .gltf");
  parser.add_option("--out", a.out, "File to write; its extension says what")->type_name("FILE");
  parser.add_option("--shape", a.shape, "Shape parameters in their own units: stature=1.8")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE,...");
  parser.add_flag("--json", a.json, "measure: as JSON");
  const OptionReader options = add_option_flags(parser, body_model_options());
  return [arguments, options] {
    const OptionSet given = options();
    return run(*arguments, given.table, options_of<BodyOptions>(given));
  };
}

}  // namespace atelier

#endif
#endif
