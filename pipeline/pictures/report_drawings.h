#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bodymodel/formats/tracked_motion.h"
#include "capture/dataset.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/render/scene.h"
#include "core/render/studio.h"
#include "pipeline/row/report_places.h"

namespace atelier {

// Drawing functions for the report's images of stages.

inline constexpr std::size_t kReportPictures = 4;  ///< frames that are shown
inline constexpr int kReportWide = 290;            ///< pixels: four images beside each other
inline constexpr int kReportNarrow = 210;          ///< six
inline constexpr int kReportHeight = 460;          ///< pixels

/// The image inside the page, as JPEG, with a caption.
std::string figure_html(const Image& image, const std::string& caption);

/// Meshes in the studio, of the report's height.
Image seen_in_report(const std::vector<RenderMesh>& meshes, const View& view, int width);

/// With three channels.
Image coloured(Image image);

/// The folder of a stage's current result.
std::filesystem::path result_folder_of(const StageStatus& status, const ReportPlaces& places);

/// The status of the stage that makes a kind ("scans"), where its result is sound; else null.
const StageStatus* sound_maker(const ReportPlaces& places, std::string_view kind);

/// The folder of the result that holds a kind; one that is not there where there is no such result.
std::filesystem::path maker_folder(const ReportPlaces& places, std::string_view kind);

/// The capture that a stage's result was made from, opened as then. Throws DataError.
Dataset dataset_of(const StageStatus& status);

/// Of the result that holds the scans. Throws DataError.
std::optional<Dataset> scanned_dataset(const ReportPlaces& places);

/// The tracked sequence that is clothed, else the first; and the cameras that stages may open, the
/// one that sees the person's front best first.
struct ReportedTrack {
  TrackedMotion motion;
  std::vector<Index> cameras;
};

/// None where nobody was tracked. Throws DataError.
std::optional<ReportedTrack> reported_track(const ReportPlaces& places, const Dataset& dataset);

/// The direction that the person faces in a frame, across the tracked hips; zero where that is
/// unknown, and for a person lying down (body_facing).
Eigen::Vector3d tracked_facing(const std::optional<ReportedTrack>& tracked, int frame_id);

/// Draws over the image of a camera in a frame; nothing where there is nothing to draw.
using DrawOver = std::function<std::optional<Image>(
    const Camera& camera, const TrackedMotion& motion, int frame_id, const Image& image)>;

/// Some frames' images of the front camera, each drawn over; an image that `draw` has nothing for
/// is left out. Of cameras whose images are as large as their calibration says: nobody knows what
/// of others was cut off. Where there are none, a sentence says so. Throws DataError.
/// @param what  is drawn, the start of a sentence
std::string front_pictures(const ReportPlaces& places, const std::string& what,
                           const DrawOver& draw);

}  // namespace atelier
