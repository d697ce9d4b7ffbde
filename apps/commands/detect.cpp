
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/tell_consent.h"
#include "capture/keypoint_schema.h"
#include "capture/label_taxonomy.h"
#include "capture/layouts/open_dataset.h"
#include "capture/people/second_look.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/detection/detect_capture.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct DetectArguments {
  std::string capture;
  std::string model;
  std::string networks;
  std::string out;
};

struct DetectCommandOptions : CaptureDetectOptions {
  DatasetOptions capture;
};

OptionTable describe(DetectCommandOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  std::vector<std::string> schemas = keypoint_schema_names();
  schemas.insert(schemas.begin(), "auto");
  table.add("schema", options.schema, schemas,
            "Order of the keypoints of the network; auto: recognised by their number");
  std::vector<std::string> taxonomies = label_taxonomy_names();
  taxonomies.insert(taxonomies.begin(), "auto");
  table.add("taxonomy", options.taxonomy, taxonomies,
            "Numbering of the classes of a parsing network; auto: recognised by their number");
  table.add(describe(options.network));
  table.add(describe(options.people));
  table.add("views", options.views,
            "Second look of the built-in detector where calibrated cameras disagree");
  table.add("masks", options.masks,
            "Masks of the people beside their keypoints, by the built-in detector");
  return table.add("mask", describe(options.mask));
}

/// The folder that results are written to, of a capture that was opened. Throws UsageError where
/// something is in the way.
fs::path result_folder(const DetectArguments& arguments, const Dataset& dataset,
                       const std::vector<std::string>& parts) {
  const bool in_place = arguments.out.empty();
  if (in_place && dataset.layout != "native") {
    throw UsageError("CAPTURE has the layout " + dataset.layout +
                     ", which takes no detections: give --out FOLDER, or make it native with "
                     "atelier convert-capture");
  }
  std::error_code error;
  if (!in_place &&
      (!fs::equivalent(arguments.out, arguments.capture, error) || dataset.layout != "native")) {
    require_outside_input(arguments.out, arguments.capture, "--out", "CAPTURE");
    require_outside_captures(arguments.out, "--out");
  }
  fs::path out = in_place ? arguments.capture : arguments.out;
  require_folder_place(out);
  for (const std::string& part : parts) {
    require_new_place(out / part, "--out");
  }
  return out;
}

/// By a network of the user's.
int run_own_network(const DetectArguments& arguments, const DetectCommandOptions& options,
                    const Dataset& dataset, const fs::path& out) {
  const DetectedCapture found = detect_by_own_network(dataset, arguments.model, options, out);
  if (found.images == 0) {
    throw DataError(arguments.capture, "", "no images", "some");
  }
  if (options.network.kind == NetworkKind::Parsing) {
    std::cout << found.images << " images, classes of " << found.said
              << " as labels of atelier: " << (out / "labels").string() << "\n";
    return kExitDone;
  }
  if (arguments.out.empty() && !found.said.empty()) {
    note_schema(out, found.said);
  }
  std::cout << found.images << " images, " << found.people << " people, points in the order "
            << (found.said.empty() ? "(nobody was found)" : found.said) << ": "
            << (out / "keypoints2d").string() << "\n";
  return kExitDone;
}

/// By the built-in detector.
int run_built_in(const DetectArguments& arguments, const DetectCommandOptions& options,
                 const Dataset& dataset, const fs::path& out, const PeopleNetworks& networks) {
  const PeopleCount count = detect_by_built_in(dataset, networks, options, out);
  for (const Finding& finding : count.findings) {
    std::cerr << "warning: " << finding.place << ": " << finding.what << "; " << finding.advice
              << "\n";
  }
  if (count.images == 0) {
    throw DataError(arguments.capture, "", "no images that can be read", "some");
  }
  if (arguments.out.empty()) {
    note_schema(out, kBuiltInSchema);
  }
  std::cout << count.images << " images, " << count.people << " people, points in the order "
            << kBuiltInSchema << ": " << (out / "keypoints2d").string() << "\n";
  if (options.masks) {
    std::cout << "masks of the people: " << (out / "labels").string() << "\n";
  }
  if (count.looked_again + count.mirrored > 0) {
    std::cout << "views that disagreed with the others: " << count.looked_again << ", of which "
              << count.settled
              << " agree after a second look; left and right exchanged: " << count.mirrored << "\n";
  }
  return kExitDone;
}

int run(const DetectArguments& arguments, const DetectCommandOptions& options) {
  if (arguments.capture.empty()) {
    throw UsageError("detect takes a CAPTURE: atelier detect CAPTURE");
  }
  const bool built_in = arguments.model.empty();
  if (built_in && options.schema != "auto" && options.schema != kBuiltInSchema) {
    throw UsageError("the built-in detector's points are in the order " +
                     std::string(kBuiltInSchema) + "; --schema is for a --model of yours");
  }
  if (built_in && options.network.kind == NetworkKind::Parsing) {
    throw UsageError(
        "--kind parsing takes --model FILE.onnx; the built-in detector finds "
        "keypoints");
  }
  if (!built_in && options.masks) {
    throw UsageError("--masks is for the built-in detector; atelier masks makes them otherwise");
  }
  if (!built_in && !arguments.networks.empty()) {
    throw UsageError("--networks is for the built-in detector, --model for a network of yours");
  }
  if (options.network.mean.size() != 3 || options.network.standard_deviation.size() != 3) {
    throw UsageError(
        "--mean and --standard-deviation take three numbers each, as in [124, 116, 104]");
  }
  const Dataset dataset = open_dataset(arguments.capture, options.capture);
  tell_ended_consent(dataset);
  const bool parsing = options.network.kind == NetworkKind::Parsing;
  std::vector<std::string> parts = {parsing ? "labels" : "keypoints2d"};
  if (options.masks) {
    parts.emplace_back("labels");
  }
  const fs::path out = result_folder(arguments, dataset, parts);
  if (!built_in) {
    return run_own_network(arguments, options, dataset, out);
  }
  return run_built_in(arguments, options, dataset, out,
                      read_people_networks(arguments.networks.empty() ? default_network_folder()
                                                                      : arguments.networks,
                                           options.people.network));
}

}  // namespace

OptionSet detect_options() {
  return option_set<DetectCommandOptions>();
}

Action add_detect(CLI::App& parser) {
  auto arguments = std::make_shared<DetectArguments>();
  add_option(parser, "CAPTURE", arguments->capture, "Capture of any layout").required();
  add_option(parser, "--model", arguments->model,
             "ONNX network of your own, instead of the built-in detector")
      .type_name("FILE.onnx");
  add_option(parser, "--networks", arguments->networks,
             "Folder of the built-in detector's networks, as scripts/detector-networks writes them")
      .type_name("FOLDER");
  add_option(parser, "--out", arguments->out,
             "Folder for keypoints2d/ or labels/; a native CAPTURE itself by default")
      .type_name("FOLDER");
  const OptionReader options = add_option_flags(parser, detect_options());
  return
      [arguments, options] { return run(*arguments, options_of<DetectCommandOptions>(options())); };
}

}  // namespace atelier
