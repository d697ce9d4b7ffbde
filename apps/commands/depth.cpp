#include <algorithm>
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
#include "core/io/json_text.h"
#include "core/io/mesh_file.h"
#include "core/printable.h"
#include "core/store/frame_selection.h"
#include "core/store/output_place.h"
#include "core/unknown_value.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/capture/depth_folder.h"

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

/// The mesh is written last, after long work: what could stop that is refused first.
void check_surface(const std::string& file) {
  const std::string extension = fs::path(file).extension().string();
  if (extension != ".obj" && extension != ".ply" && extension != ".glb") {
    throw UsageError("--surface cannot be '" + file + "': it ends in .obj, .ply or .glb");
  }
  require_new_place(file, "--surface");
  require_file_place(file);
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
  const std::string origin = depth_origin(views, frame, arguments.device, options);
  open_depth_folder(folder, origin);
  ReconstructOptions used = options.reconstruct;
  settle_cameras(views, used, device);
  const StraightInstant instant = straight_instant(std::move(views), used);
  make_private_directory(folder);
  write_file_atomically(folder / "depth.json", origin);  // first, so that a kill leaves it ours
  write_dense_workspace(folder, instant.cameras, instant.images, some_cells(instant.hull));
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
