#include "apps/commands/body_model_input.h"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <set>
#include <variant>

#include "apps/console/standard_streams.h"
#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/skin_weights.h"
#include "bodymodel/formats/tailor_measurements.h"
#include "bodymodel/human/default_human.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_gltf.h"
#include "core/io/npz.h"
#include "core/io/scene_file.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

struct Assignment {
  std::string name;
  std::string text;
  double value = 0;
};

Assignment assignment(const std::string& text, const char* form) {
  const std::size_t equals = text.rfind('=');
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text.substr(equals == std::string::npos ? text.size() : equals + 1), &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (equals == std::string::npos || used == 0 || equals + 1 + used != text.size()) {
    throw UsageError("'" + text.substr(0, 80) + "' is no " + form);
  }
  return {text.substr(0, equals), text.substr(equals + 1), value};
}

// All that are given; each name once.
std::vector<Assignment> assignments(const std::vector<std::string>& texts, const char* form) {
  std::vector<Assignment> all;
  std::set<std::string> names;
  for (const std::string& text : texts) {
    all.push_back(assignment(text, form));
    if (!names.insert(all.back().name).second) {
      throw UsageError(all.back().name.substr(0, 80) + " is given twice");
    }
  }
  return all;
}

std::vector<Assignment> shape_assignments(const BodyArguments& arguments) {
  std::vector<std::string> texts = arguments.shape;
  std::erase_if(texts, has_measurements_extension);
  return assignments(texts, "NAME=NUMBER");
}

/// The default human with the measurements of those files that --shape names.
DefaultHumanOptions measured_human(const BodyArguments& arguments, DefaultHumanOptions human) {
  for (const std::string& text : arguments.shape) {
    if (has_measurements_extension(text)) {
      TailorMeasurements measurements = read_tailor_measurements(text);
      human = with_measurements(human, measurements);
      print(measurements.findings);
    }
  }
  return human;
}

// The default human is recomputed with the measures asked for, so that what is not asked for
// follows from them.
BodyModel generated(const BodyArguments& arguments) {
  DefaultHumanOptions human = arguments.body == "female" ? female_human()
                              : arguments.body == "male" ? male_human()
                                                         : DefaultHumanOptions{};
  human = measured_human(arguments, human);
  OptionTable table = describe(human);
  for (const Assignment& one : shape_assignments(arguments)) {
    std::string known;
    bool found = false;
    for (const OptionField& field : table.fields) {
      if (std::holds_alternative<double*>(field.target)) {
        known += (known.empty() ? "" : ", ") + field.name;
        found = found || field.name == one.name;
      }
    }
    if (!found) {
      throw UsageError("the body has no shape parameter '" + one.name.substr(0, 80) + "'; it has " +
                       known);
    }
    if (!std::isfinite(one.value)) {
      throw UsageError(set_option(table, one.name, one.text));
    }
    for (const OptionField& field : table.fields) {
      if (field.name == one.name) {
        *std::get<double*>(field.target) = one.value;  // human_options_problem says the range
      }
    }
  }
  const std::string problem = human_options_problem(human);
  if (!problem.empty()) {
    throw UsageError(problem);
  }
  return default_human(human);
}

void set_shape(const BodyModel& model, const std::string& name, double value,
               Eigen::VectorXd& shape) {
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
    throw UsageError(name + " cannot be " + short_number(value) + ": it is in [" +
                     short_number(parameter.min) + ", " + short_number(parameter.max) + "]" +
                     (parameter.unit.empty() ? "" : " " + parameter.unit));
  }
  shape[index] = value;
}

BodyFileOptions file_options(const BodyOptions& options) {
  const MakeHumanMacros& macros = options.macros;
  const double shares = macros.african + macros.asian + macros.caucasian;
  if (!(std::abs(shares - 1) <= 1e-6)) {
    throw UsageError("macros.african, macros.asian and macros.caucasian add up to " +
                     short_number(shares) + ": they are shares of 1");
  }
  BodyFileOptions files;
  files.makehuman.macros = macros;
  files.rig = options.rig;
  files.weights = options.weights;
  files.metres_per_unit = options.metres_per_unit;
  return files;
}

}  // namespace

OptionTable describe(BodyOptions& options) {
  OptionTable table;
  table.add("four_influences", options.four_influences,
            "At most four joints influencing a vertex, as viewers and game engines expect");
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

void print(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    standard_error() << printable(to_string(finding)) << "\n";
  }
}

bool is_generated(const BodyArguments& arguments) {
  return arguments.body == "default" || arguments.body == "female" || arguments.body == "male";
}

bool is_makehuman(const BodyArguments& arguments) {
  return !is_generated(arguments) && (lower_extension(arguments.body) == ".obj" ||
                                      std::filesystem::is_directory(arguments.body));
}

bool holds_motion(const std::string& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".bvh" || extension == ".amc" || extension == ".trc" || extension == ".c3d") {
    return true;
  }
  if (std::filesystem::is_directory(file)) {
    return false;
  }
  if (extension == ".npz") {
    const Npz npz(file);
    const std::string schema = archive_schema(npz);
    const bool amass =
        !npz.contains("v_template") && (npz.contains("poses") || npz.contains("root_orient"));
    return schema.starts_with("atelier-motion") || (schema.empty() && amass);
  }
  if (has_scene_extension(file)) {
    const GltfScene scene = read_scene(file);
    bool skinned = false;
    for (const GltfNode& node : scene.nodes) {
      skinned = skinned || (node.mesh >= 0 && node.skin >= 0);
    }
    bool moves = false;  // joints of a skin, or nodes of a scene without one
    for (const GltfAnimation& animation : scene.animations) {
      for (const GltfChannel& channel : animation.channels) {
        moves =
            moves || channel.path == GltfPath::Rotation || channel.path == GltfPath::Translation;
      }
    }
    return !skinned && moves;
  }
  return false;
}

bool holds_body(const std::string& file) {
  const std::string extension = lower_extension(file);
  if (file == "default" || file == "female" || file == "male" || extension == ".obj") {
    return true;
  }
  if (std::filesystem::is_directory(file)) {
    return std::filesystem::exists(std::filesystem::path(file) / "base.obj");
  }
  if (extension == ".npz") {
    const Npz npz(file);
    return archive_schema(npz).starts_with("atelier-body") || npz.contains("v_template");
  }
  if (has_scene_extension(file)) {
    const GltfScene scene = read_scene(file);
    return scene.animations.empty() && !scene.skins.empty();
  }
  return false;
}

ShapedInput read_body_input(const BodyArguments& arguments, const BodyOptions& options) {
  BodyFileOptions files = file_options(options);
  const std::vector<Assignment> targets = assignments(arguments.target, "FILE=WEIGHT");
  for (const Assignment& target : targets) {
    files.targets.emplace_back(target.name);
  }
  BodyFile body = is_generated(arguments) ? BodyFile{generated(arguments), {}}
                                          : read_body_file(arguments.body, files);
  print(body.findings);
  if (options.four_influences) {
    SkinPackOptions pack;
    pack.max_slots = 4;
    body.model.skin =
        repair_skin_weights(body.model.skin, joint_count(body.model), pack, arguments.body).skin;
  }
  ShapedInput input{std::move(body.model), {}};
  input.shape = neutral_shape(input.model);
  if (is_generated(arguments)) {
    return input;  // made with the measures asked for
  }
  for (const Assignment& target : targets) {
    set_shape(input.model, std::filesystem::path(target.name).stem().string(), target.value,
              input.shape);
  }
  for (const std::string& text : arguments.shape) {
    if (has_measurements_extension(text)) {
      throw UsageError("--shape " + text.substr(0, 80) +
                       " has no effect here: measurements shape default, female and male");
    }
  }
  for (const Assignment& one : shape_assignments(arguments)) {
    set_shape(input.model, one.name, one.value, input.shape);
  }
  return input;
}

}  // namespace atelier
