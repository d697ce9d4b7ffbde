#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/surface/reconstruct_scan.h"
#include "core/options.h"
#include "pipeline/capture/reconstruct_stage.h"

namespace atelier {

struct DepthOptions {
  int frame = -1;
  DatasetOptions capture;
  ReconstructOptions reconstruct;
  double memory = 8;  ///< GiB: images are halved until the work fits
};
OptionTable describe(DepthOptions& options);

/// Inputs and options of the depth maps of a frame in a folder, as text: those of other images or
/// options are not mixed. Where the capture lies does not matter, as machines see it at different
/// places.
std::string depth_origin(const std::vector<InstantView>& views, int frame,
                         const std::string& device, const DepthOptions& options);

/// Where the maps go: a new folder, or one that was begun with the same origin (depth.json). Throws
/// UsageError, DataError otherwise.
void open_depth_folder(const std::filesystem::path& folder, const std::string& origin);

/// Some of the hull's cells [m], spread over it.
Points some_cells(const VisualHull& hull);

}  // namespace atelier
