#ifdef ATELIER_HAS_CAPTURE

#include "capture/validate.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/option_flags.h"
#include "apps/printable.h"
#include "apps/usage_error.h"
#include "capture/layouts/open_dataset.h"
#include "core/store/consent.h"

namespace atelier {
namespace {

struct ValidateArguments {
  std::string capture;
  bool json = false;
};

/// How to read the capture, and what to check.
struct ValidateCommandOptions {
  DatasetOptions capture;
  ValidateOptions checks;
};

OptionTable describe(ValidateCommandOptions& options) {
  OptionTable table;
  table.add(describe(options.capture));
  table.add(describe(options.checks));
  return table;
}

int run(const ValidateArguments& arguments, const ValidateCommandOptions& options) {
  if (arguments.capture.empty()) {
    throw UsageError("it takes a CAPTURE: atelier validate CAPTURE");
  }
  FrameReader reader(open_dataset(arguments.capture, options.capture));
  const Dataset& dataset = reader.dataset();
  const std::vector<Finding> findings = validate(reader, options.checks);
  const std::string consent = to_string(dataset.info.consent);
  if (arguments.json) {
    nlohmann::ordered_json json = {
        {"capture", arguments.capture},        {"layout", dataset.layout},
        {"evidence", dataset.evidence},        {"cameras", dataset.cameras.size()},
        {"frames", frame_ids(dataset).size()}, {"consent", consent}};
    json["findings"] = nlohmann::ordered_json::array();
    for (const Finding& finding : findings) {
      json["findings"].push_back({{"severity", severity_name(finding.severity)},
                                  {"code", finding.code},
                                  {"place", finding.place},
                                  {"what", finding.what},
                                  {"advice", finding.advice}});
    }
    std::cout << json.dump(1) << "\n";
  } else {
    std::cout << printable(arguments.capture) << ": " << dataset.layout << " ("
              << printable(dataset.evidence) << "), "
              << counted(static_cast<std::int64_t>(dataset.cameras.size()), "camera") << ", "
              << counted(static_cast<std::int64_t>(frame_ids(dataset).size()), "frame")
              << "\n  consent: " << printable(consent) << "\n";
    for (const Finding& finding : findings) {
      std::cout << "  " << printable(to_string(finding)) << "\n";
    }
    std::cout << (has_errors(findings) ? "it cannot be used as it is\n"
                  : findings.empty()   ? "nothing to complain of\n"
                                       : "it can be used\n");
  }
  return has_errors(findings) ? kExitBadData : kExitDone;
}

}  // namespace

OptionSet validate_options() {
  return option_set<ValidateCommandOptions>();
}

Action add_validate(CLI::App& parser) {
  auto arguments = std::make_shared<ValidateArguments>();
  parser.add_option("CAPTURE", arguments->capture, "A folder, or a calibration file in it")
      ->required();
  parser.add_flag("--json", arguments->json, "For machines");
  const OptionReader options = add_option_flags(parser, validate_options());
  return [arguments, options] {
    return run(*arguments, options_of<ValidateCommandOptions>(options()));
  };
}

}  // namespace atelier

#endif
