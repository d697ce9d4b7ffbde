#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/standard_streams.h"
#include "apps/console/tell_consent.h"
#include "capture/layouts/open_dataset.h"
#include "capture/sentence.h"
#include "capture/surface/color_gains.h"
#include "capture/surface/color_samples.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/capture/sampled_colors.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct CalibrateColorArguments {
  std::string capture;
  std::string out;
  std::string truth;
  bool json = false;
};

struct CalibrateColorOptions {
  int frames = 3;
  DatasetOptions capture;
  ColorGainOptions gains;
  CoarseReconstructionOptions samples;
  ReconstructOptions reconstruct;
};

OptionTable describe(CalibrateColorOptions& options) {
  OptionTable table;
  table.add("frames", options.frames, 1, 1000, "",
            "Number of frames used, evenly spread over the capture");
  table.add("capture", describe(options.capture));
  table.add("gains", describe(options.gains));
  table.add("samples", describe(options.samples));
  table.add(describe(options.reconstruct));
  return table;
}

int run(const CalibrateColorArguments& arguments, const CalibrateColorOptions& options) {
  if (arguments.capture.empty() || arguments.out.empty()) {
    throw UsageError(
        "calibrate-color takes a CAPTURE and --out: atelier calibrate-color CAPTURE --out "
        "cameras.json");
  }
  require_file_place(arguments.out);
  if (fs::path(arguments.out).extension() != ".json") {
    throw UsageError("--out cannot be '" + arguments.out + "': a name that ends in .json");
  }
  require_outside_input(arguments.out, arguments.capture, "--out", "CAPTURE");
  require_outside_captures(arguments.out, "--out");
  const Dataset dataset = open_dataset(arguments.capture, options.capture);
  tell_ended_consent(dataset);
  if (!dataset.calibrated) {
    throw DataError(arguments.capture, "", "cameras without calibration",
                    "calibrated ones; atelier calibrate estimates them");
  }
  const auto [samples, used] = sample_colors(
      dataset, arguments.capture, options.frames, options.reconstruct, options.samples,
      [](const std::string& line) { standard_error() << printable(line) << "\n"; });
  const ColorGains gains =
      color_gains(static_cast<int>(dataset.cameras.size()), samples, options.gains);
  std::vector<Camera> cameras = dataset.cameras;
  nlohmann::ordered_json json = {{"schema", "atelier-color-calibration"},
                                 {"version", 1},
                                 {"frames", used},
                                 {"samples", samples.size()},
                                 {"spread", gains.spread}};
  json["cameras"] = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    cameras[c].gain = gains.gain[c];
    const Eigen::Vector3d& g = gains.gain[c];
    const Eigen::Vector3d& d = gains.deviation[c];
    json["cameras"].push_back({{"id", cameras[c].id},
                               {"gain", {g[0], g[1], g[2]}},
                               {"deviation", {d[0], d[1], d[2]}},
                               {"measured", static_cast<bool>(gains.measured[c])},
                               {"points", gains.points[c]}});
    if (arguments.json) {
      continue;
    }
    std::cout << (gains.measured[c]
                      ? sentence("%-12s gain %.4f %.4f %.4f +- %.2f%%, from %d points\n",
                                 cameras[c].id.c_str(), g[0], g[1], g[2], 100 * d.maxCoeff(),
                                 gains.points[c])
                      : sentence(
                            "%-12s gain not measured, left at 1 (%d points shared, %d needed)\n",
                            cameras[c].id.c_str(), gains.points[c], options.gains.min_points));
  }
  for (const Finding& finding : gains.findings) {
    Finding named = finding;
    named.place = cameras[static_cast<std::size_t>(std::stoi(finding.place))].id;
    standard_error() << printable(to_string(named)) << "\n";
  }
  write_file_atomically(arguments.out, cameras_json(cameras));
  if (!arguments.truth.empty()) {
    const GainError error = gain_error(cameras, read_ground_truth(arguments.truth).cameras);
    json["mean_error"] = error.mean;
    json["largest_error"] = error.largest;
    if (!arguments.json) {
      std::cout << sentence("against the ground-truth gains: mean error %.2f%%, largest %.2f%%\n",
                            100 * error.mean, 100 * error.largest);
    }
  }
  if (arguments.json) {
    std::cout << json_text(json, 1) << "\n";
  } else {
    char text[80];
    std::snprintf(text, sizeof text, "one sample is %.1f%% off its point's colour (robust)\n",
                  100 * gains.spread);
    std::cout << text;
    std::cout << printable(arguments.out) << "\n";
  }
  return kExitDone;
}

}  // namespace

OptionSet calibrate_color_options() {
  return option_set<CalibrateColorOptions>();
}

Action add_calibrate_color(CLI::App& parser) {
  auto arguments = std::make_shared<CalibrateColorArguments>();
  add_option(parser, "CAPTURE", arguments->capture, "Calibrated capture with masks or labels")
      .required();
  add_option(parser, "--out", arguments->out,
             "File for the cameras with their gains (cameras.json)")
      .type_name("FILE");
  add_option(parser, "--ground-truth,--truth", arguments->truth,
             "Synthetic capture whose ground-truth gains the result is compared with")
      .type_name("CAPTURE");
  add_flag(parser, "--json", arguments->json, "Report as JSON, for programs");
  const OptionReader options = add_option_flags(parser, calibrate_color_options());
  return [arguments, options] {
    return run(*arguments, options_of<CalibrateColorOptions>(options()));
  };
}

}  // namespace atelier
