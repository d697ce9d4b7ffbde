#include "bodymodel/body_file.h"

#include <cctype>

#include "bodymodel/body_archive.h"
#include "bodymodel/default_human.h"
#include "bodymodel/gltf_body.h"
#include "bodymodel/smpl.h"
#include "core/error.h"
#include "core/io/npz.h"

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
  MakeHumanBody body = read_makehuman(files, options.makehuman, limits);
  return {std::move(body.model), std::move(body.findings)};
}

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
  if (extension == ".glb" || extension == ".gltf") {
    GltfBody body = read_gltf_body(path, limits);
    return {std::move(body.model), std::move(body.findings)};
  }
  if (extension == ".npz") {
    const Npz npz(path, limits);
    return {archive_schema(npz).empty() ? read_smpl(npz) : body_of_arrays(npz), {}};
  }
  throw DataError(path.string(), "file name", "extension '" + extension.substr(0, 20) + "'",
                  "default, female, male, .npz, .glb, .gltf or MakeHuman's base.obj");
}

}  // namespace atelier
