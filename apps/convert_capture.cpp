#ifdef ATELIER_HAS_CAPTURE

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/option_flags.h"
#include "apps/output_place.h"
#include "apps/printable.h"
#include "apps/usage_error.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/store/file_kind.h"

namespace atelier {
namespace {

struct ConvertCaptureArguments {
  std::string in;
  std::string out;
  std::string to = "native";
};

std::string layout_choices() {
  std::string text;
  for (const std::string& name : layout_names()) {
    text += (text.empty() ? "" : "|") + name;
  }
  return text;
}

/// The folder that a calibration file is in, or the capture's own.
std::filesystem::path capture_folder(const std::string& in) {
  return file_kind(in) == std::filesystem::file_type::regular
             ? std::filesystem::absolute(in).parent_path()
             : std::filesystem::path(in);
}

int run(const ConvertCaptureArguments& arguments, const DatasetOptions& options) {
  if (arguments.in.empty() || arguments.out.empty()) {
    throw UsageError("it takes two folders: atelier convert-capture IN OUT");
  }
  if (is_inside(arguments.out, capture_folder(arguments.in))) {
    throw UsageError(
        "OUT lies in the capture IN, which is not changed; name a folder outside of it");
  }
  require_folder_place(std::filesystem::absolute(arguments.out).parent_path());
  const Dataset dataset = open_dataset(arguments.in, options);
  std::cout << arguments.in << ": " << dataset.layout << " (" << printable(dataset.evidence)
            << "), " << counted(static_cast<std::int64_t>(dataset.cameras.size()), "camera") << ", "
            << counted(static_cast<std::int64_t>(frame_ids(dataset).size()), "frame") << "\n";
  for (const Finding& finding : dataset.findings) {
    std::cout << "  " << printable(to_string(finding)) << "\n";
  }
  const LayoutReport report = write_layout(dataset, arguments.to, arguments.out);
  for (const std::string& sentence : report.lost) {
    std::cout << "  " << arguments.to << ": " << sentence << "\n";
  }
  std::cout << "  consent: " << printable(to_string(dataset.info.consent))
            << (report.consent.empty() ? "" : "; kept in " + report.consent.string()) << "\n";
  for (const std::filesystem::path& folder : report.folders) {
    std::cout << folder.string() << "\n";
  }
  return kExitDone;
}

}  // namespace

OptionSet convert_capture_options() {
  return option_set<DatasetOptions>();
}

Action add_convert_capture(CLI::App& parser) {
  auto arguments = std::make_shared<ConvertCaptureArguments>();
  parser.add_option("IN", arguments->in, "Capture to read: a folder, or a calibration file in it")
      ->required();
  parser.add_option("OUT", arguments->out, "Folder to write; new")->required();
  parser.add_option("--to", arguments->to, "Layout to write [native]")
      ->check(one_of(layout_names()))
      ->type_name(layout_choices());
  const OptionReader options = add_option_flags(parser, convert_capture_options());
  return [arguments, options] { return run(*arguments, options_of<DatasetOptions>(options())); };
}

}  // namespace atelier

#endif
