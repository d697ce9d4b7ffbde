#pragma once

#include <filesystem>
#include <string>

#include "capture/dataset.h"
#include "capture/layouts/corrections.h"
#include "core/limits.h"
#include "core/options.h"

namespace atelier {

/// Information that the files lack or state wrongly.
struct DatasetOptions {
  std::string layout = "auto";  ///< "auto": told by the files; else one of layout_names()
  double metres_per_unit = 0;   ///< length of the calibration's unit, (0, 1e6]; 0: as the layout
  std::string up = "auto";      ///< axis of the calibration that points up; "auto": as the layout
  double fps = 0;               ///< frames per second, (0, 10000]; 0: what the files say
  std::string keypoint_schema =
      "auto";                           ///< order of the 2D keypoints; "auto": told by their number
  std::string label_taxonomy = "auto";  ///< numbers of label images; "auto": as the layout
  std::string subject = "auto";         ///< of layouts with several (Human3.6M); "auto": the first
  std::string links = "follow";         ///< symbolic links in the folder; "refuse": DataError
  CorrectionOptions corrections;        ///< what is wrong in the files, under names of its own
};
OptionTable describe(DatasetOptions& options);

/// Opens a capture: a folder, or a calibration file with its folder around it. The layout is told
/// by the files that are there; where two fit, the more specific is taken and a finding names the
/// other. A camera whose numbers are no camera is left out with a finding; a camera whose images
/// are an exact scale of the calibrated size has its intrinsics scaled, with a finding.
///
/// Throws DataError where no layout fits (with the layouts that were tried), or where the files of
/// the layout are truncated, contradict each other or go beyond `limits`, or have no such subject;
/// EnvironmentError if they
/// cannot be read.
Dataset open_dataset(const std::filesystem::path& path, const DatasetOptions& options = {},
                     const Limits& limits = {});

/// Refuses what `synthesize` has not finished. Throws DataError that says how it goes on.
void require_finished(const std::filesystem::path& path);

/// Refuses a folder with symbolic links in it. Throws DataError that names the first.
void require_no_links(const std::filesystem::path& path);

/// What every stage refuses of a capture that is its INPUT: a folder above one, and symbolic links
/// where its option "capture.links" asks for that, which is no part of a result's key. Opens no
/// file. Throws DataError.
void check_capture_input(const std::filesystem::path& path, const OptionTable& options);

/// Refuses a folder that is no capture, but holds one: the folder above was named. Opens no file.
/// Throws DataError with the capture's place.
void require_no_folder_above(const std::filesystem::path& path);

}  // namespace atelier
