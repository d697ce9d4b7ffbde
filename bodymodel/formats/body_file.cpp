#include "bodymodel/formats/body_file.h"

#include <cctype>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/body_size.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/smpl.h"
#include "bodymodel/human/default_human.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/io/scene_file.h"
#include "core/nearest_name.h"
#include "core/quantity_text.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

BodyFile read_makehuman_file(const std::filesystem::path& base, const BodyFileOptions& options,
                             const Limits& limits) {
  const std::filesystem::path folder = base.parent_path();
  MakeHumanFiles files;
  files.base = base;
  files.rig = options.rig.empty() ? folder / "default.mhskel" : options.rig;
  files.weights = options.weights.empty() ? folder / "default_weights.mhw" : options.weights;
  const std::filesystem::path macros = folder / ".." / "targets" / "macrodetails";
  if (std::filesystem::is_directory(macros)) {
    files.macros = macros;
  }
  files.targets = options.targets;
  MakeHumanBody body = read_makehuman(files, options.makehuman, limits);
  return {std::move(body.model), std::move(body.findings)};
}

// Throws as check_body_size; UnknownValue where the unit that was set makes no person's size.
void check_size_as_said(const BodyModel& model, const std::string& file, double metres_per_unit) {
  try {
    check_body_size(model, file);
  } catch (const DataError& error) {
    if (metres_per_unit == 1 || error.expected.find("metres_per_unit") == std::string::npos) {
      throw;
    }
    throw UnknownValue(file, "metres_per_unit", short_number(metres_per_unit),
                       "the length of the file's unit, which makes " + error.found + ", and not " +
                           error.expected.substr(0, error.expected.find(';')));
  }
}

struct Refusal {
  const char* extension;
  const char* found;
  const char* advice;
};
// Files that people have of bodies and that are not read.
constexpr Refusal kRefusals[] = {
    {".pkl", "a Python pickle, which can run code and is never loaded",
     "an .npz of its arrays, saved by numpy.savez"},
    {".pt", "a TorchScript archive, which can run code and is never loaded",
     "the model's mesh and skin; MHR releases them as FBX, lod0.fbx to lod6.fbx"},
    {".model", "a table of joint parameters (momentum), without mesh and skin",
     "the body's mesh and skin: MHR's lod0.fbx to lod6.fbx"}};

}  // namespace

BodyFile read_body_file(const std::filesystem::path& path, const BodyFileOptions& options,
                        const Limits& limits) {
  if (path == "default") {
    return {default_human(), {}};
  }
  if (path == "female") {
    return {default_human(female_human()), {}};
  }
  if (path == "male") {
    return {default_human(male_human()), {}};
  }
  if (std::filesystem::is_directory(path)) {
    return read_makehuman_file(path / "base.obj", options, limits);
  }
  std::string extension = path.extension().string();
  for (char& c : extension) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  if (extension == ".obj") {
    return read_makehuman_file(path, options, limits);
  }
  if (has_scene_extension(path)) {
    GltfBody body = read_gltf_body(path, limits);
    if (options.metres_per_unit != 1) {
      body.model = scaled_body(std::move(body.model), options.metres_per_unit);
    }
    check_size_as_said(body.model, path.string(), options.metres_per_unit);
    return {std::move(body.model), std::move(body.findings)};
  }
  if (extension == ".npz") {
    const Npz npz(path, limits);
    if (npz.contains("corrective_blendshapes") || npz.contains("posedirs_sparse_mask")) {
      throw DataError(path.string(), "arrays", "MHR's pose correctives without a body",
                      "the body's mesh and skin, lod0.fbx to lod6.fbx; its correctives are the "
                      "output of a network, not linear in the pose, and are not read");
    }
    if (!archive_schema(npz).empty() && options.metres_per_unit != 1) {
      throw UnknownValue(path.string(), "metres_per_unit", short_number(options.metres_per_unit),
                         "1: an archive says its unit");
    }
    SmplOptions smpl;
    smpl.metres_per_unit = options.metres_per_unit;
    SmplBody body = archive_schema(npz).empty() ? read_smpl(npz, smpl, limits)
                                                : SmplBody{body_of_arrays(npz, limits), {}};
    check_size_as_said(body.model, path.string(), options.metres_per_unit);
    return {std::move(body.model), std::move(body.findings)};
  }
  for (const Refusal& refusal : kRefusals) {
    if (extension == refusal.extension) {
      throw DataError(path.string(), "file name", refusal.found, refusal.advice);
    }
  }
  const std::string expected =
      "default, female, male, .npz, .glb, .gltf, .fbx or MakeHuman's base.obj or its folder" +
      did_you_mean(path.string(), {"default", "female", "male"});
  if (extension.empty()) {
    throw UnknownValue("", "body", path.string(), expected);
  }
  throw DataError(path.string(), "file name", "extension '" + extension.substr(0, 20) + "'",
                  expected);
}

}  // namespace atelier
