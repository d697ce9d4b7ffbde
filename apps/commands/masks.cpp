#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/tell_consent.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/masks/capture_masks.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct MasksArguments : MaskSources {
  std::string out;
  bool json = false;
};

struct MasksOptions : CaptureMaskOptions {
  DatasetOptions capture;
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
      const fs::path file = true_mask_file(arguments, dataset.cameras[c].id, frame);
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
  CaptureMaskOptions settled = options;
  settled.method = method;
  const std::vector<CameraMasks> results =
      make_masks(dataset, arguments, settled, unfinished.content());
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
