#include "bodymodel/input/body_input.h"

#include <cmath>
#include <filesystem>
#include <set>
#include <variant>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/skin_weights.h"
#include "bodymodel/formats/tailor_measurements.h"
#include "bodymodel/human/default_human.h"
#include "core/error.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_gltf.h"
#include "core/io/npz.h"
#include "core/io/scene_file.h"
#include "core/quantity_text.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

struct Assignment {
  std::string name;
  std::string text;
  double value = 0;

  std::string given() const { return name + "=" + text; }
};

constexpr const char* kShape = "--shape";
constexpr const char* kTarget = "--target";

[[noreturn]] void refuse(const char* flag, const std::string& given, const std::string& why) {
  throw UsageError(std::string(flag) + " cannot be '" + given.substr(0, 80) + "': " + why);
}

Assignment assignment(const std::string& text, const char* flag, const char* form) {
  const std::size_t equals = text.rfind('=');
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text.substr(equals == std::string::npos ? text.size() : equals + 1), &used);
  } catch (const std::logic_error&) {
    used = 0;
  }
  if (equals == std::string::npos || used == 0 || equals + 1 + used != text.size()) {
    refuse(flag, text, std::string("it takes ") + form);
  }
  return {text.substr(0, equals), text.substr(equals + 1), value};
}

// All that are given; each name once.
std::vector<Assignment> assignments(const std::vector<std::string>& texts, const char* flag,
                                    const char* form) {
  std::vector<Assignment> all;
  std::set<std::string> names;
  for (const std::string& text : texts) {
    all.push_back(assignment(text, flag, form));
    if (!names.insert(all.back().name).second) {
      throw UsageError(std::string(flag) + " " + all.back().name.substr(0, 80) + " is given twice");
    }
  }
  return all;
}

std::vector<Assignment> shape_assignments(const BodySource& source) {
  std::vector<std::string> texts = source.shape;
  std::erase_if(texts, has_measurements_extension);
  return assignments(texts, kShape, "NAME=NUMBER");
}

/// The default human with the measurements of those files that --shape names.
DefaultHumanOptions measured_human(const BodySource& source, DefaultHumanOptions human,
                                   const TellFindings& tell) {
  for (const std::string& text : source.shape) {
    if (has_measurements_extension(text)) {
      TailorMeasurements measurements = read_tailor_measurements(text);
      human = with_measurements(human, measurements);
      tell(measurements.findings);
    }
  }
  return human;
}

// The default human is recomputed with the measures asked for, so that what is not asked for
// follows from them.
BodyModel generated_body(const BodySource& source, const TellFindings& tell) {
  DefaultHumanOptions human = source.body == "female" ? female_human()
                              : source.body == "male" ? male_human()
                                                      : DefaultHumanOptions{};
  human = measured_human(source, human, tell);
  OptionTable table = describe(human);
  for (const Assignment& one : shape_assignments(source)) {
    std::string known;
    bool found = false;
    for (const OptionField& field : table.fields) {
      if (std::holds_alternative<double*>(field.target)) {
        known += (known.empty() ? "" : ", ") + field.name;
        found = found || field.name == one.name;
      }
    }
    if (!found) {
      refuse(kShape, one.given(),
             "the body has no shape parameter '" + one.name.substr(0, 80) + "'; it has " + known);
    }
    if (!std::isfinite(one.value)) {
      refuse(kShape, one.given(), set_option(table, one.name, one.text));
    }
    for (const OptionField& field : table.fields) {
      if (field.name == one.name) {
        *std::get<double*>(field.target) = one.value;
      }
    }
    if (const std::string problem = human_options_problem(human); !problem.empty()) {
      refuse(kShape, one.given(), problem);
    }
  }
  if (const std::string problem = human_options_problem(human); !problem.empty()) {
    throw UsageError(problem);
  }
  try {
    return default_human(human);
  } catch (const DataError& error) {  // measures that nobody has together
    const std::vector<Assignment> given = shape_assignments(source);
    const bool from_file = given.size() < source.shape.size();
    if (given.empty() || from_file || !error.file.empty()) {
      throw;
    }
    std::string all;
    for (const Assignment& one : given) {
      all += (all.empty() ? "" : ",") + one.given();
    }
    refuse(kShape, all, error.what());
  }
}

void set_shape(const BodyModel& model, const std::string& name, const Assignment& one,
               const char* flag, Eigen::VectorXd& shape) {
  const double value = one.value;
  const int index = find_shape(model, name);
  if (index < 0) {
    std::string known;
    for (const ShapeParameter& parameter : model.shape) {
      known += (known.empty() ? "" : ", ") + parameter.name;
    }
    refuse(flag, one.given(),
           "the body has no shape parameter '" + name.substr(0, 80) + "'; it has " +
               (known.empty() ? "none" : known));
  }
  const ShapeParameter& parameter = model.shape[static_cast<std::size_t>(index)];
  if (!(value >= parameter.min && value <= parameter.max)) {
    refuse(flag, one.given(),
           name + " cannot be " + short_number(value) + ": it is in [" +
               short_number(parameter.min) + ", " + short_number(parameter.max) + "]" +
               (parameter.unit.empty() ? "" : " " + parameter.unit));
  }
  shape[index] = value;
}

BodyFileOptions file_options(const BodyInputOptions& options) {
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

bool is_generated_body(const std::string& body) {
  return body == "default" || body == "female" || body == "male";
}

bool is_makehuman_body(const std::string& body) {
  return !is_generated_body(body) &&
         (lower_extension(body) == ".obj" || std::filesystem::is_directory(body));
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
  if (is_generated_body(file) || extension == ".obj") {
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

ShapedInput read_body_input(const BodySource& source, const BodyInputOptions& options,
                            const TellFindings& tell) {
  BodyFileOptions files = file_options(options);
  const std::vector<Assignment> targets = assignments(source.target, kTarget, "FILE=WEIGHT");
  for (const Assignment& target : targets) {
    files.targets.emplace_back(target.name);
  }
  BodyFile body = is_generated_body(source.body) ? BodyFile{generated_body(source, tell), {}}
                                                 : read_body_file(source.body, files);
  tell(body.findings);
  if (options.four_influences) {
    SkinPackOptions pack;
    pack.max_slots = 4;
    body.model.skin =
        repair_skin_weights(body.model.skin, joint_count(body.model), pack, source.body).skin;
  }
  ShapedInput input{std::move(body.model), {}};
  input.shape = neutral_shape(input.model);
  if (is_generated_body(source.body)) {
    return input;  // made with the measures asked for
  }
  for (const Assignment& target : targets) {
    set_shape(input.model, std::filesystem::path(target.name).stem().string(), target, kTarget,
              input.shape);
  }
  for (const std::string& text : source.shape) {
    if (has_measurements_extension(text)) {
      throw UsageError("--shape " + text.substr(0, 80) +
                       " has no effect here: measurements shape default, female and male");
    }
  }
  for (const Assignment& one : shape_assignments(source)) {
    set_shape(input.model, one.name, one, kShape, input.shape);
  }
  return input;
}

}  // namespace atelier
