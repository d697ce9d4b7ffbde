#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "apps/console/arguments.h"
#include "apps/console/stand_alone.h"
#include "core/atomic_file.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/store/consent.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "pipeline/capture/validate_stage.h"
#include "pipeline/pictures/validate_page.h"

namespace atelier {
namespace {

void print(const std::string& name, const Dataset& dataset, const Validation& validation) {
  std::cout << printable(name) << ": " << dataset.layout << " (" << printable(dataset.evidence)
            << "), " << counted(static_cast<std::int64_t>(dataset.cameras.size()), "camera") << ", "
            << counted(static_cast<std::int64_t>(frame_ids(dataset).size()), "frame")
            << "\n  consent: " << printable(to_string(dataset.info.consent)) << "\n";
  for (const Finding& finding : validation.findings) {
    std::cout << "  " << printable(to_string(finding)) << "\n";
  }
  const std::vector<std::string> settings = settings_of(validation.findings);
  if (!settings.empty()) {
    std::cout << "options that correct the capture as far as options can:\n";
  }
  for (const std::string& setting : settings) {
    std::cout << "  " << printable(setting) << "\n";
  }
  std::cout << (has_errors(validation.findings) ? "the capture cannot be used as it is\n"
                : validation.findings.empty()   ? "no defects were found\n"
                                                : "the capture can be used\n");
}

int validate_alone(const StandAloneRequest& request, const std::optional<std::string>& html) {
  const auto& chosen = options_of<ValidateStageOptions>(request.options);
  const std::string& capture = request.input;
  if (html && is_inside(*html, capture)) {
    throw UsageError(
        "--html lies in the capture, which is not changed; choose a path outside of it");
  }
  FrameReader reader(judged_dataset(capture, chosen));
  const Validation validation = judged_validation(reader, capture, chosen);
  if (html) {
    const std::filesystem::path root = std::filesystem::path(capture).lexically_normal();
    const std::string name =
        root.has_filename() ? root.filename().string() : root.parent_path().filename().string();
    write_file_atomically(*html, validate_page(reader, validation, name));
  }
  if (request.json) {
    std::cout << validation_json(capture, reader.dataset(), validation);
  } else {
    print(capture, reader.dataset(), validation);
    if (html) {
      std::cout << "with images: " << printable(*html) << "\n";
    }
  }
  return has_errors(validation.findings) ? kExitBadData : kExitDone;
}

}  // namespace

StandAloneWork add_validate_alone(CLI::App& parser) {
  auto html = std::make_shared<std::optional<std::string>>();
  add_option(
      parser, "--html", [html](const std::string& text) { *html = text; },
      "Without a workspace: HTML page to write, with contact sheets, camera layout and error plots")
      .type_name("FILE");
  return {[html] { return *html ? "--html" : ""; },
          [html](const StandAloneRequest& request) { return validate_alone(request, *html); }};
}

}  // namespace atelier
