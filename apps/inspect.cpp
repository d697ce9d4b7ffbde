#include <iostream>
#include <memory>

#include "apps/arguments.h"
#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/inspection.h"
#include "apps/json_text.h"
#include "apps/usage_error.h"
#include "core/error.h"
#include "core/io/lower_extension.h"
#include "core/store/file_kind.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

struct Kind {
  const char* extension;
  void (*inspect)(const std::filesystem::path& path, Inspection& inspection);
};

constexpr Kind kKinds[] = {
    {".obj", inspect_mesh},    {".ply", inspect_mesh},
    {".glb", inspect_scene},   {".gltf", inspect_scene},
    {".fbx", inspect_scene},   {".npz", inspect_npz},
    {".npy", inspect_npy},     {".png", inspect_image},
    {".jpg", inspect_image},   {".jpeg", inspect_image},
    {".tif", inspect_image},   {".tiff", inspect_image},
    {".webp", inspect_image},  {".bmp", inspect_image},
    {".avif", inspect_image},  {".safetensors", inspect_safetensors},
    {".h5", inspect_hdf5},     {".hdf5", inspect_hdf5},
    {".json", inspect_json},   {".toml", inspect_toml},
#ifdef ATELIER_HAS_BODYMODEL
    {".bvh", inspect_motion},  {".amc", inspect_motion},
    {".trc", inspect_markers}, {".c3d", inspect_markers},
#endif
};

std::uintmax_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    throw EnvironmentError(path.string(), system_reason(error.value()));
  }
  return size;
}

Inspection inspect(const std::filesystem::path& path) {
  const std::filesystem::file_type there = file_kind(path);
  if (there == std::filesystem::file_type::not_found) {
    throw DataError(path.string(), "", "nothing there", "a file");
  }
  if (there == std::filesystem::file_type::directory) {
    Inspection inspection;
    inspection.add("folder", path.string());
    inspect_folder(path, inspection);
    return inspection;
  }
  if (there != std::filesystem::file_type::regular) {
    throw DataError(path.string(), "", "not a regular file", "a file or a folder");
  }
  const std::string extension = lower_extension(path);
  std::string known;
  for (const Kind& kind : kKinds) {
    if (extension == kind.extension) {
      Inspection inspection;
      inspection.add("file", path.string());
      inspection.add("size", size_of(path), "bytes");
      kind.inspect(path, inspection);
      return inspection;
    }
    known += (known.empty() ? "" : ", ") + std::string(kind.extension);
  }
  throw DataError(path.string(), "", "a kind of file that is not known", "one of " + known);
}

int run(const std::string& file, bool as_json) {
  if (file.empty()) {
    throw UsageError("inspect takes a FILE: atelier inspect FILE");
  }
  const Inspection inspection = inspect(file);
  const int code = has_errors(inspection.findings) ? kExitBadData : kExitDone;
  std::cout << (as_json ? json_text(json_of(inspection), 1) + "\n" : text_of(inspection));
  return code;
}

}  // namespace

Action add_inspect(CLI::App& parser) {
  auto file = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  add_option(parser, "FILE", *file,
             "Mesh, image, npy, npz, safetensors, HDF5, JSON, TOML, body, motion, or a folder of a "
             "result, sequence, capture or meshes")
      .required();
  add_flag(parser, "--json", *json, "For machines");
  return [file, json] { return run(*file, *json); };
}

}  // namespace atelier
