#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/dataset.h"

namespace atelier {

/// A capture written in another layout: its folder, and what that layout cannot represent.
struct LayoutReport {
  std::vector<std::filesystem::path> folders;  ///< one for each sequence
  std::vector<std::string> lost;               ///< one sentence each
  std::filesystem::path consent;  ///< consent.toml under `out`; empty: there is none to keep, or
                                  ///< the layout itself (native) holds it
};

/// Every layout that is read and written: "native", "easymocap", "colmap", ...
const std::vector<std::string>& layout_names();

/// Writes a capture in another layout, a folder for each sequence under `out` (new); the native
/// layout, which holds several sequences, is `out` itself. Units, axes, pixel origins and
/// distortion orders are those of the layout (docs/reference/formats.md). Images keep their bytes
/// (hard links where the disk allows); frames of videos become PNG. Calibrations come last, so that
/// what was interrupted has none. Consent, which no other layout has a place for, goes to
/// consent.toml under `out`, where every reader of captures looks for it. `stop` is asked before
/// every frame. Throws DataError for frames that cannot be read, LogicError for a layout that is
/// none, EnvironmentError for a folder that is there or a disk that fails, StopRequested
/// (digest_meter.h) if `stop` says so: what is there by then is left to the caller.
LayoutReport write_layout(const Dataset& dataset, const std::string& layout,
                          const std::filesystem::path& out, const std::function<bool()>& stop = {});

/// The same of a finished native capture.
LayoutReport write_layout(const std::filesystem::path& capture, const std::string& layout,
                          const std::filesystem::path& out);

}  // namespace atelier
