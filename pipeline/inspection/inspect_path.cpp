#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/alembic.h"
#include "core/io/lower_extension.h"
#include "core/store/workspace_folder.h"
#include "core/system_reason.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {
namespace {

struct Kind {
  const char* extension;
  void (*inspect)(const std::filesystem::path& path, Inspection& inspection);
};

constexpr Kind kKinds[] = {
    {".obj", inspect_mesh},          {".ply", inspect_mesh},
    {".glb", inspect_scene},         {".gltf", inspect_scene},
    {".fbx", inspect_scene},         {".usd", inspect_usd},
    {".usda", inspect_usda},         {".npz", inspect_npz},
    {".npy", inspect_npy},           {".png", inspect_image},
    {".jpg", inspect_image},         {".jpeg", inspect_image},
    {".tif", inspect_image},         {".tiff", inspect_image},
    {".webp", inspect_image},        {".bmp", inspect_image},
    {".avif", inspect_image},        {".svg", inspect_svg},
    {".dxf", inspect_dxf},           {".safetensors", inspect_safetensors},
    {".h5", inspect_hdf5},           {".hdf5", inspect_hdf5},
    {".smc", inspect_hdf5},  // DNA-Rendering's
    {".json", inspect_json},         {".jsonl", inspect_json_lines},
    {".toml", inspect_toml},         {".csv", inspect_table},
    {".html", inspect_page},         {".zip", inspect_zip},
    {".mp4", inspect_video},         {".mov", inspect_video},
    {".avi", inspect_video},         {".mkv", inspect_video},
    {".m4v", inspect_video},         {".webm", inspect_video},
    {".yml", inspect_yaml},          {".yaml", inspect_yaml},
    {".txt", inspect_colmap_text},   {".bin", inspect_colmap_binary},
    {".bvh", inspect_motion},        {".amc", inspect_motion},
    {".trc", inspect_markers},       {".c3d", inspect_markers},
    {".target", inspect_target},     {".mhclo", inspect_mhclo},
    {".mhskel", inspect_json},       {".mhw", inspect_json},
    {".usdc", inspect_usd_mesh},     {".usdz", inspect_usd_mesh},
    {".stl", inspect_mesh},          {".vit", inspect_measurements},
    {".smis", inspect_measurements},
};

/// Kinds that are known and not shown, and what to do instead.
struct Refused {
  const char* extension;
  const char* found;
  const char* expected;
};

constexpr Refused kRefused[] = {
    {".pkl", "a Python pickle, which runs code when it is read", "its numbers as .npz"},
    {".pt", "a file of torch, which runs code when it is read", "its tensors as .safetensors"},
    {".pth", "a file of torch, which runs code when it is read", "its tensors as .safetensors"},
    {".onnx", "a network, which only detect opens", "atelier detect CAPTURE --model FILE.onnx"},
    {".exr", "an OpenEXR image, which is not read", "PNG or TIFF of 8 or 16 bits"},
    {".heic", "a HEIF image, which is not read", "JPEG or PNG: heif-convert IN OUT.png writes it"},
    {".heif", "a HEIF image, which is not read", "JPEG or PNG: heif-convert IN OUT.png writes it"},
    {".dng", "raw data of a sensor, which are not read", "PNG or TIFF, as dcraw -T writes it"},
    {".xcp", "a calibration by Vicon, which is not read",
     "the same as TOML: Pose2Sim's calibration converts it ('convert_from = vicon')"},
    {".vst", "a table of sizes", "the measurements of one person: those of a size, saved as .vit"},
    {".smms", "a table of sizes",
     "the measurements of one person: those of a size, saved as .smis"},
    {".asf", "an Acclaim skeleton, which is read with its motion", "the .amc beside it"},
};

std::uintmax_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    throw EnvironmentError(path.string(), system_reason(error.value()));
  }
  return size;
}

}  // namespace

Inspection inspect_path(const std::filesystem::path& path, std::span<const Stage> stages) {
  const std::filesystem::file_type there = file_kind(path);
  if (there == std::filesystem::file_type::not_found) {
    throw DataError(path.string(), "", "nothing there", "a file");
  }
  if (there == std::filesystem::file_type::directory) {
    Inspection inspection;
    inspection.stages = stages;
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
      inspection.stages = stages;
      inspection.add("file", path.string());
      inspection.add("size", size_of(path), "bytes");
      kind.inspect(path, inspection);
      return inspection;
    }
    known += (known.empty() ? "" : ", ") + std::string(kind.extension);
  }
  refuse_alembic(path);
  if (const std::string advice = unseal_advice(path); !advice.empty()) {
    throw DataError(path.string(), "", "a sealed file",
                    "an open one: " + advice + ", atelier verify says to how many it is sealed");
  }
  for (const Refused& kind : kRefused) {
    if (extension == kind.extension) {
      throw DataError(path.string(), "", kind.found, kind.expected);
    }
  }
  if (size_of(path) == 0) {
    throw DataError(path.string(), "", "an empty file", "one with something in it");
  }
  throw DataError(path.string(), "", "a kind of file that is not known", "one of " + known);
}

}  // namespace atelier
