#ifdef ATELIER_HAS_CAPTURE

#include "apps/validate.h"

#include <filesystem>
#include <iostream>

#include "apps/exit_code.h"
#include "apps/output_place.h"
#include "apps/usage_error.h"
#include "apps/validate_page.h"
#include "apps/validate_stage.h"
#include "core/atomic_file.h"
#include "core/printable.h"
#include "core/store/consent.h"

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

}  // namespace

int validate_alone(const std::map<std::string, std::string>& values, const OptionSet& options,
                   Device /*device*/, bool json) {
  const std::string& capture = values.at("INPUT");
  const auto& chosen = options_of<ValidateStageOptions>(options);
  const auto html = values.find("html");
  if (html != values.end() && is_inside(html->second, capture)) {
    throw UsageError(
        "--html lies in the capture, which is not changed; choose a path outside of it");
  }
  FrameReader reader(without_held_out_pictures(open_dataset(capture, chosen.capture)));
  const Validation validation = validate(reader, chosen.checks);
  if (html != values.end()) {
    const std::filesystem::path root = std::filesystem::path(capture).lexically_normal();
    const std::string name =
        root.has_filename() ? root.filename().string() : root.parent_path().filename().string();
    write_file_atomically(html->second, validate_page(reader, validation, name));
  }
  if (json) {
    std::cout << validation_json(capture, reader.dataset(), validation);
  } else {
    print(capture, reader.dataset(), validation);
    if (html != values.end()) {
      std::cout << "with pictures: " << printable(html->second) << "\n";
    }
  }
  return has_errors(validation.findings) ? kExitBadData : kExitDone;
}

}  // namespace atelier

#endif
