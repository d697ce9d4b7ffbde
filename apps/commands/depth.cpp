#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/standard_streams.h"
#include "apps/console/tell_consent.h"
#include "capture/layouts/colmap_dense.h"
#include "capture/stereo/share_views.h"
#include "capture/surface/reconstruct_scan.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json_text.h"
#include "core/io/mesh_file.h"
#include "core/printable.h"
#include "core/sha256.h"
#include "core/store/frame_selection.h"
#include "core/store/output_place.h"
#include "core/unknown_value.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/capture/reconstruct_stage.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct DepthArguments {
  std::string capture;
  std::string out;
  std::string views = "0/1";
  std::string surface;
  std::string device = "cpu";
  bool json = false;
};

struct DepthOptions {
  int frame = -1;
  DatasetOptions capture;
  ReconstructOptions reconstruct;
  double memory = 8;  ///< GiB: images are halved until the work fits
};

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

/// Inputs and options of the maps in a folder: those of other images or options are not mixed.
/// Where the capture lies does not matter, as machines see it at different places.
std::string origin_of(const DepthArguments& arguments, const DepthOptions& options, int frame,
                      const std::vector<InstantView>& views) {
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
      {"device", arguments.device},
      {"options", nlohmann::json::parse(canonical_json(describe(of_maps)))}};
  return json_text(origin, 1);
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

/// Where the maps go: a new folder, or one that was begun with the same options.
void open_folder(const fs::path& folder, const std::string& origin) {
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

/// The mesh is written last, after long work: what could stop that is refused first.
void check_surface(const std::string& file) {
  const std::string extension = fs::path(file).extension().string();
  if (extension != ".obj" && extension != ".ply" && extension != ".glb") {
    throw UsageError("--surface cannot be '" + file + "': it ends in .obj, .ply or .glb");
  }
  require_new_place(file, "--surface");
  require_file_place(file);
}

/// Some of the hull's cells.
Points places_in(const VisualHull& hull) {
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

int run(const DepthArguments& arguments, const DepthOptions& options) {
  if (arguments.capture.empty() || arguments.out.empty()) {
    throw UsageError("depth takes a CAPTURE and OUT: atelier depth CAPTURE OUT");
  }
  FrameSelection share;
  if (const std::string wrong = set_shard(share, arguments.views); !wrong.empty()) {
    throw UsageError("--views cannot be '" + arguments.views + "': it is i/n, i from 0 to n - 1");
  }
  if (!arguments.surface.empty()) {
    check_surface(arguments.surface);
  }
  require_outside_input(arguments.out, arguments.capture, "OUT", "the capture");
  if (!arguments.surface.empty()) {
    require_outside_input(arguments.surface, arguments.capture, "--surface", "the capture");
  }
  const Device device = arguments.device == "cuda" ? Device::Cuda : Device::Cpu;
  const Dataset dataset = stage_dataset(arguments.capture, options.capture);
  tell_ended_consent(dataset);
  const std::vector<int> frames = frames_with_masks(dataset);
  if (frames.empty()) {
    throw DataError(arguments.capture, "", "no masks and no labels",
                    "some; atelier masks creates them");
  }
  const int frame = options.frame < 0 ? frames.front() : options.frame;
  if (std::find(frames.begin(), frames.end(), frame) == frames.end()) {
    throw UnknownValue(arguments.capture, "frame", std::to_string(frame),
                       "a frame with masks or labels in two views, from " +
                           std::to_string(frames.front()) + " to " + std::to_string(frames.back()));
  }
  const fs::path folder = arguments.out;
  const int halvings = halvings_for(dataset, options.memory);
  if (halvings > 0) {
    standard_error() << halvings_text(halvings, options.memory) << "\n";
  }
  std::vector<InstantView> views = instant_of(dataset, frame, halvings);
  const std::string origin = origin_of(arguments, options, frame, views);
  open_folder(folder, origin);
  ReconstructOptions used = options.reconstruct;
  settle_cameras(views, used, device);
  const StraightInstant instant = straight_instant(std::move(views), used);
  make_private_directory(folder);
  write_file_atomically(folder / "depth.json", origin);  // first, so that a kill leaves it ours
  write_dense_workspace(folder, instant.cameras, instant.images, places_in(instant.hull));
  std::vector<std::size_t> wanted = share_of_views(instant.cameras, share.shard, share.shards);
  std::erase_if(wanted,
                [&](std::size_t view) { return has_depth_map(folder, instant.cameras[view]); });
  const std::size_t computed = computed_views(instant, used, wanted).size();
  std::vector<DepthMap> maps;
  if (!wanted.empty()) {
    maps = instant_depths(instant, used, device, wanted);
    for (const std::size_t view : wanted) {
      write_depth_map(folder, maps[view]);
    }
  }
  std::vector<Finding> findings = instant.findings;
  std::size_t there = 0;
  for (const Camera& camera : instant.cameras) {
    there += has_depth_map(folder, camera) ? 1 : 0;
  }
  if (!arguments.surface.empty()) {
    maps.clear();
    for (const Camera& camera : instant.cameras) {
      maps.push_back(read_depth_map(folder, camera));
    }
    const ReconstructedScan scan = surface_of(instant, std::move(maps), used);
    findings = scan.findings;
    write_mesh(arguments.surface, scan.scan);
  }
  for (const Finding& finding : findings) {
    standard_error() << printable(to_string(finding)) << "\n";
  }
  if (arguments.json) {
    const nlohmann::ordered_json json = {{"frame", frame},        {"views", instant.cameras.size()},
                                         {"made", wanted.size()}, {"computed", computed},
                                         {"there", there},        {"out", arguments.out}};
    std::cout << json_text(json, 1) << "\n";
  } else {
    std::cout << "frame " << frame << ": " << wanted.size() << " depth maps made (" << computed
              << " views computed), " << there << " of " << instant.cameras.size() << " are there\n"
              << (arguments.surface.empty() ? arguments.out : arguments.surface) << "\n";
  }
  return kExitDone;
}

}  // namespace

OptionSet depth_options() {
  return option_set<DepthOptions>();
}

Action add_depth(CLI::App& parser) {
  auto arguments = std::make_shared<DepthArguments>();
  add_option(parser, "CAPTURE", arguments->capture, "Calibrated capture with masks or labels")
      .required();
  add_option(
      parser, "OUT", arguments->out,
      "Folder for one frame's maps, also a dense workspace of COLMAP; existing maps are kept")
      .required();
  add_option(parser, "--views", arguments->views,
             "Part of the views, those side by side, for n machines that share a frame [0/1]")
      .type_name("i/n");
  add_option(parser, "--surface", arguments->surface,
             "File for the labelled surface, once the maps of all views exist")
      .type_name("MESH");
  add_option(parser, "--device", arguments->device, "Device of the computation")
      .check(one_of({"cpu", "cuda"}))
      .type_name("cpu|cuda");
  add_flag(parser, "--json", arguments->json, "Output as JSON, for programs");
  const OptionReader options = add_option_flags(parser, depth_options());
  return [arguments, options] { return run(*arguments, options_of<DepthOptions>(options())); };
}

}  // namespace atelier
