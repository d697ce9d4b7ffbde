#include "pipeline/masks/capture_masks.h"

#include <algorithm>
#include <optional>

#include "capture/frame_reader.h"
#include "capture/layouts/frame_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/parallel.h"
#include "core/plain_name.h"
#include "core/quantity_text.h"
#include "core/three_channels.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The empty stage as one camera sees it: PLATES/<camera>.png, or every image of
/// PLATES/<camera>/.
std::vector<Image> plates_of(const fs::path& folder, const std::string& camera) {
  std::vector<Image> plates;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}) {
    const fs::path file = folder / (camera + extension);
    if (fs::is_regular_file(file)) {
      plates.push_back(in_three_channels(read_image(file)));
    }
  }
  for (const auto& [frame, place] : camera_pictures(folder, camera)) {
    if (place.index < 0 && place.member.empty()) {
      plates.push_back(in_three_channels(read_image(place.file)));
    }
  }
  if (plates.empty()) {
    throw DataError(folder.string(), "camera '" + camera + "'", "no plate",
                    camera + ".png, or a folder " + camera + " of images of the empty stage");
  }
  return plates;
}

/// @param out  folder of folders of cameras
CameraMasks masks_of(const Dataset& dataset, std::size_t c, const MaskSources& sources,
                     const CaptureMaskOptions& options, const fs::path& out) {
  const MaskMethod method = options.method;
  CameraMasks result;
  FrameReader reader(dataset);
  const auto index = static_cast<Index>(c);
  const std::string& id = dataset.cameras[c].id;
  std::vector<int> frames;
  for (const auto& [frame, place] : dataset.frames[c].images) {
    frames.push_back(frame);
  }
  if (frames.empty()) {
    return result;
  }
  EmptyStage background;
  MovingBackground moving;
  if (method == MaskMethod::Plates) {
    background = background_of_plates(plates_of(sources.plates, id));
  } else if (method == MaskMethod::Time) {
    std::vector<Image> some;
    const std::size_t count =
        std::min(frames.size(), static_cast<std::size_t>(options.background_frames));
    for (std::size_t i = 0; i < count; ++i) {
      if (auto image = reader.image(index, frames[i * frames.size() / count])) {
        some.push_back(in_three_channels(std::move(*image)));
      }
    }
    moving = background_over_time(some, options.mask);
    constexpr double kDoubtful = 0.05;
    if (moving.still_share > kDoubtful) {
      result.findings.push_back(
          {Severity::Warning, "mask-background-doubtful", id,
           "in " + percent(moving.still_share) +
               " of the image something stays or moves for half of the time",
           "take clean plates (--plates), or frames in which the person walks about"});
    }
    background = moving.background;
  }
  double cut = 0;  // of all masks' outlines, where they have no edge
  const fs::path folder = out / id;
  make_private_directory(folder);
  for (const int frame : frames) {
    std::optional<Image> image;
    try {
      image = reader.image(index, frame);
    } catch (const DataError& error) {
      result.findings.push_back({Severity::Warning, "mask-picture-broken",
                                 id + " " + std::to_string(frame), error.what(), "it has no mask"});
      continue;
    }
    const Image picture = in_three_channels(std::move(*image));
    if (method != MaskMethod::Chroma &&
        (picture.width != background.mean.width || picture.height != background.mean.height)) {
      throw DataError(sources.plates.empty() ? sources.capture : sources.plates,
                      "camera '" + id + "'",
                      "a background of " + std::to_string(background.mean.width) + " x " +
                          std::to_string(background.mean.height) + " pixels",
                      std::to_string(picture.width) + " x " + std::to_string(picture.height));
    }
    const ByteImage mask =
        method == MaskMethod::Chroma ? mask_by_chroma(picture, options.chroma, options.mask)
        : method == MaskMethod::Time ? mask_over_time(picture, moving, options.mask)
                                     : mask_from_background(picture, background, options.mask);
    const auto set = std::count_if(mask.data.begin(), mask.data.end(),
                                   [](std::uint8_t value) { return value != 0; });
    if (set == 0) {
      result.findings.push_back(
          {Severity::Warning, "mask-empty", id + " " + std::to_string(frame), "nobody was found",
           method == MaskMethod::Time ? "take clean plates (--plates) of somebody who stands still"
                                      : "lower --mask.threshold"});
    } else if (method == MaskMethod::Time) {
      cut += outline_without_edge(picture, mask, background, options.mask);
    }
    result.covered += static_cast<double>(set) / static_cast<double>(mask.data.size());
    write_labels(folder / (frame_name(frame) + ".png"), mask);
    if (!sources.truth.empty()) {
      result.iou += mask_iou(mask, read_labels(true_mask_file(sources, id, frame)));
      ++result.judged;
    }
    ++result.written;
  }
  constexpr double kCut = 0.06;  // of true masks of rendered people at most 0.03
  if (result.written > 0 && cut > kCut * result.written) {
    result.findings.push_back(
        {Severity::Warning, "mask-cuts-through", id,
         "at " + percent(cut / result.written) +
             " of the masks' outline both sides look alike: they cut through the person, or take "
             "background in, where the background was hardly ever seen",
         "take clean plates (--plates), or frames in which the person walks about"});
  }
  return result;
}

}  // namespace

fs::path true_mask_file(const MaskSources& sources, const std::string& camera, int frame) {
  return fs::path(sources.truth) / "truth" / "labels" / camera / (frame_name(frame) + ".png");
}

std::vector<CameraMasks> make_masks(const Dataset& dataset, const MaskSources& sources,
                                    const CaptureMaskOptions& options, const fs::path& out) {
  std::vector<CameraMasks> results(dataset.cameras.size());
  parallel_for(static_cast<Index>(results.size()), 1, [&](Index begin, Index end) {
    for (Index c = begin; c < end; ++c) {
      results[static_cast<std::size_t>(c)] =
          masks_of(dataset, static_cast<std::size_t>(c), sources, options, out);
    }
  });
  return results;
}

}  // namespace atelier
