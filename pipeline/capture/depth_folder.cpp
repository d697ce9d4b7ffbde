#include "pipeline/capture/depth_folder.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/json_text.h"
#include "core/sha256.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A digest of what the views are: cameras, images, masks.
std::string digest_of(const std::vector<InstantView>& views) {
  Sha256 sum;
  const auto add = [&](const auto& values) {
    sum.update(values.data(), values.size() * sizeof(values[0]));
  };
  for (const InstantView& view : views) {
    const std::string camera = cameras_json({view.camera});
    add(camera);
    add(view.image.data);
    add(view.mask.data);
  }
  return hex(sum.finish());
}

/// Differences of two origins, in words.
std::string difference_of(const nlohmann::json& there, const nlohmann::json& wanted) {
  const auto differs = [&](const char* key) {
    return there.value(key, nlohmann::json()) != wanted.at(key);
  };
  if (differs("views")) {
    return "other images: of another capture or frame, or of another size (--memory)";
  }
  if (differs("device")) {
    return "another device";
  }
  return "other options";
}

}  // namespace

OptionTable describe(DepthOptions& options) {
  OptionTable table;
  table.add("frame", options.frame, -1, 1000000000, "",
            "Number of the frame of the capture; -1: the first with masks or labels");
  table.add("capture", describe(options.capture));
  table.add(describe(options.reconstruct));
  table.add("memory", options.memory, 0.01, 4096, "GiB",
            "Memory for the frame, all of whose views are processed at once; images are halved in "
            "size until it suffices");
  return table;
}

std::string depth_origin(const std::vector<InstantView>& views, int frame,
                         const std::string& device, const DepthOptions& options) {
  DepthOptions of_maps = options;
  of_maps.capture = {};  // what these two do is in the views
  of_maps.memory = DepthOptions{}.memory;
  of_maps.frame = frame;
  // Steps that only come after the maps.
  of_maps.reconstruct.fuse = {};
  of_maps.reconstruct.surface = {};
  of_maps.reconstruct.labels = {};
  of_maps.reconstruct.hull_support = false;
  const nlohmann::ordered_json origin = {
      {"schema", "atelier-depth"},
      {"version", 1},
      {"views", digest_of(views)},
      {"device", device},
      {"options", nlohmann::json::parse(canonical_json(describe(of_maps)))}};
  return json_text(origin, 1);
}

void open_depth_folder(const fs::path& folder, const std::string& origin) {
  const fs::path file = folder / "depth.json";
  if (!fs::exists(file)) {
    require_new_place(folder, "OUT");
    require_folder_place(folder);
    return;
  }
  const std::string there = read_file_text(file, 1 << 24);
  if (there == origin) {
    return;
  }
  const nlohmann::json said = nlohmann::json::parse(there, nullptr, false);
  if (!said.is_object() || said.value("schema", nlohmann::json()) != "atelier-depth") {
    throw DataError(file.string(), "", "no record of what the maps were made from",
                    "the file that depth wrote; give a new folder, or remove " + folder.string());
  }
  throw UsageError("OUT " + folder.string() + " holds maps of " +
                   difference_of(said, nlohmann::json::parse(origin)) +
                   "; give a new folder, or remove it");
}

Points some_cells(const VisualHull& hull) {
  constexpr std::size_t kMost = 500;
  std::vector<Eigen::Vector3d> cells;
  for (int z = 0; z < hull.nz; ++z) {
    for (int y = 0; y < hull.ny; ++y) {
      for (int x = 0; x < hull.nx; ++x) {
        if (hull.at(x, y, z)) {
          cells.push_back(hull.origin +
                          hull.voxel_size * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
        }
      }
    }
  }
  const std::size_t count = std::min(kMost, cells.size());
  Points places(static_cast<Index>(count), 3);
  for (std::size_t i = 0; i < count; ++i) {
    places.row(static_cast<Index>(i)) = cells[i * cells.size() / count].transpose();
  }
  return places;
}

}  // namespace atelier
