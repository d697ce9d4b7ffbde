#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/tell_consent.h"
#include "capture/frame_reader.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/open_dataset.h"
#include "capture/masks/background.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/json_text.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

enum class MaskMethod { Auto, Plates, Chroma, Time };

struct MasksArguments {
  std::string capture;
  std::string out;
  std::string plates;
  std::string truth;
  bool json = false;
};

struct MasksOptions {
  MaskMethod method = MaskMethod::Auto;
  int background_frames = 40;
  DatasetOptions capture;
  MaskOptions mask;
  ChromaOptions chroma;
};

OptionTable describe(MasksOptions& options) {
  OptionTable table;
  table.add("method", options.method,
            {{"auto", MaskMethod::Auto},
             {"plates", MaskMethod::Plates},
             {"chroma", MaskMethod::Chroma},
             {"time", MaskMethod::Time}},
            "Method of segmentation: plates (clean plates), chroma (coloured screen) or time (the "
            "most frequent colour of each pixel); auto: plates where they are given, else time");
  table.add("background_frames", options.background_frames, 5, 1000, "",
            "Number of frames of each camera, spread over time, from which the method time learns "
            "the background");
  table.add("capture", describe(options.capture));
  table.add("mask", describe(options.mask));
  table.add("chroma", describe(options.chroma));
  return table;
}

Image three_channels(Image image) {
  if (image.channels == 3) {
    return image;
  }
  Image colour(image.width, image.height, 3);
  for (std::size_t i = 0; i < colour.data.size(); ++i) {
    colour.data[i] = image.data[i / 3];
  }
  return colour;
}

/// The empty stage as one camera sees it: PLATES/<camera>.png, or every image of
/// PLATES/<camera>/.
std::vector<Image> plates_of(const fs::path& folder, const std::string& camera) {
  std::vector<Image> plates;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}) {
    const fs::path file = folder / (camera + extension);
    if (fs::is_regular_file(file)) {
      plates.push_back(three_channels(read_image(file)));
    }
  }
  for (const auto& [frame, place] : camera_pictures(folder, camera)) {
    if (place.index < 0 && place.member.empty()) {
      plates.push_back(three_channels(read_image(place.file)));
    }
  }
  if (plates.empty()) {
    throw DataError(folder.string(), "camera '" + camera + "'", "no plate",
                    camera + ".png, or a folder " + camera + " of images of the empty stage");
  }
  return plates;
}

/// Outcome for one camera.
struct CameraMasks {
  int written = 0;
  double covered = 0;  ///< mean share of the image
  double iou = 0;      ///< against the ground truth, mean
  int judged = 0;
  std::vector<Finding> findings;
};

/// Of the ground truth, of one image.
fs::path truth_labels(const MasksArguments& arguments, const std::string& camera, int frame) {
  return fs::path(arguments.truth) / "truth" / "labels" / camera / (frame_name(frame) + ".png");
}

/// @param out  folder of folders of cameras
CameraMasks masks_of(const Dataset& dataset, std::size_t c, const MasksArguments& arguments,
                     MaskMethod method, const MasksOptions& options, const fs::path& out) {
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
    background = background_of_plates(plates_of(arguments.plates, id));
  } else if (method == MaskMethod::Time) {
    std::vector<Image> some;
    const std::size_t count =
        std::min(frames.size(), static_cast<std::size_t>(options.background_frames));
    for (std::size_t i = 0; i < count; ++i) {
      if (auto image = reader.image(index, frames[i * frames.size() / count])) {
        some.push_back(three_channels(std::move(*image)));
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
    const Image picture = three_channels(std::move(*image));
    if (method != MaskMethod::Chroma &&
        (picture.width != background.mean.width || picture.height != background.mean.height)) {
      throw DataError(arguments.plates.empty() ? arguments.capture : arguments.plates,
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
    if (!arguments.truth.empty()) {
      result.iou += mask_iou(mask, read_labels(truth_labels(arguments, id, frame)));
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

/// Refuses before the work what would end it: all of it, or none, is written.
void check_places(const Dataset& dataset, const MasksArguments& arguments, MaskMethod method) {
  if (method == MaskMethod::Plates && arguments.plates.empty()) {
    throw UsageError("--method plates takes --plates FOLDER, images of the empty stage");
  }
  if (method != MaskMethod::Plates && !arguments.plates.empty()) {
    throw UsageError("--plates goes with --method plates or auto; leave it out, or the method");
  }
  require_new_place(fs::path(arguments.out) / "labels", "--out");
  require_folder_place(arguments.out);
  const bool any = std::any_of(dataset.frames.begin(), dataset.frames.end(),
                               [](const CameraFrames& f) { return !f.images.empty(); });
  if (!any) {
    throw DataError(arguments.capture, "", "no images", "some");
  }
  for (std::size_t c = 0; c < dataset.cameras.size() && !arguments.truth.empty(); ++c) {
    for (const int frame : dataset.frames[c].images.frames()) {
      const fs::path file = truth_labels(arguments, dataset.cameras[c].id, frame);
      if (file_kind(file) == fs::file_type::not_found) {
        throw DataError(file.string(), "", "no ground-truth labels of an image of CAPTURE",
                        "--ground-truth with the synthetic capture that CAPTURE is of");
      }
    }
  }
}

int run(MasksArguments arguments, const MasksOptions& options) {
  if (arguments.capture.empty()) {
    throw UsageError("masks takes a CAPTURE: atelier masks CAPTURE --plates FOLDER");
  }
  const Dataset dataset = open_dataset(arguments.capture, options.capture);
  tell_ended_consent(dataset);
  std::error_code error;
  if (arguments.out.empty()) {
    if (dataset.layout != "native") {
      throw UsageError("CAPTURE has the layout " + dataset.layout +
                       ", which takes no masks: give --out FOLDER, or make it native with atelier "
                       "convert-capture");
    }
    arguments.out = arguments.capture;
  } else if (!fs::equivalent(arguments.out, arguments.capture, error) ||
             dataset.layout != "native") {
    require_outside_input(arguments.out, arguments.capture, "--out", "CAPTURE");
    require_outside_captures(arguments.out, "--out");
  }
  MaskMethod method = options.method;
  if (method == MaskMethod::Auto) {
    method = arguments.plates.empty() ? MaskMethod::Time : MaskMethod::Plates;
  }
  check_places(dataset, arguments, method);
  const UnfinishedFolder unfinished(fs::path(arguments.out) / "labels");
  std::vector<CameraMasks> results(dataset.cameras.size());
  parallel_for(static_cast<Index>(results.size()), 1, [&](Index begin, Index end) {
    for (Index c = begin; c < end; ++c) {
      results[static_cast<std::size_t>(c)] = masks_of(
          dataset, static_cast<std::size_t>(c), arguments, method, options, unfinished.content());
    }
  });
  unfinished.finish();
  nlohmann::ordered_json json = {{"capture", arguments.capture},
                                 {"out", (fs::path(arguments.out) / "labels").string()}};
  json["cameras"] = nlohmann::ordered_json::array();
  double iou = 0;
  int judged = 0;
  for (std::size_t c = 0; c < results.size(); ++c) {
    const CameraMasks& result = results[c];
    iou += result.iou;
    judged += result.judged;
    nlohmann::ordered_json one = {{"id", dataset.cameras[c].id}, {"masks", result.written}};
    one["covered"] = result.written > 0 ? result.covered / result.written : 0;
    if (result.judged > 0) {
      one["iou"] = result.iou / result.judged;
    }
    json["cameras"].push_back(one);
    if (arguments.json) {
      continue;
    }
    char text[160];
    std::snprintf(text, sizeof text, "%-12s %d masks, %.1f%% of the image",
                  dataset.cameras[c].id.c_str(), result.written,
                  result.written > 0 ? 100 * result.covered / result.written : 0);
    std::cout << text;
    if (result.judged > 0) {
      std::snprintf(text, sizeof text, ", IoU %.4f", result.iou / result.judged);
      std::cout << text;
    }
    std::cout << "\n";
    for (const Finding& finding : result.findings) {
      std::cout << "  " << printable(to_string(finding)) << "\n";
    }
  }
  if (judged > 0) {
    json["iou"] = iou / judged;
  }
  if (arguments.json) {
    std::cout << json_text(json, 1) << "\n";
  } else {
    if (judged > 0) {
      char text[80];
      std::snprintf(text, sizeof text, "mean IoU against the ground truth %.4f\n", iou / judged);
      std::cout << text;
    }
    std::cout << (fs::path(arguments.out) / "labels").string() << "\n";
  }
  return kExitDone;
}

}  // namespace

OptionSet masks_options() {
  return option_set<MasksOptions>();
}

Action add_masks(CLI::App& parser) {
  auto arguments = std::make_shared<MasksArguments>();
  add_option(parser, "CAPTURE", arguments->capture, "Capture of any layout").required();
  add_option(parser, "--out", arguments->out,
             "Folder for labels/<camera>/<frame>.png; a native CAPTURE itself by default")
      .type_name("FOLDER");
  add_option(parser, "--plates", arguments->plates,
             "Images of the empty stage: <camera>.png, or a folder for each camera")
      .type_name("FOLDER");
  add_option(parser, "--ground-truth,--truth", arguments->truth,
             "Synthetic capture whose ground-truth labels the masks are compared with")
      .type_name("CAPTURE");
  add_flag(parser, "--json", arguments->json, "Output as JSON, for programs");
  const OptionReader options = add_option_flags(parser, masks_options());
  return [arguments, options] { return run(*arguments, options_of<MasksOptions>(options())); };
}

}  // namespace atelier
