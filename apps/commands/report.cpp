#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/usage_error.h"
#include "pipeline/pictures/report_folder.h"
#include "pipeline/report/report_file.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

struct ReportArguments {
  std::string workspace;
  std::string out;
  std::string truth;
};

int run(const ReportArguments& arguments, const ReportOptions& options) {
  if (arguments.workspace.empty()) {
    throw UsageError("report takes a WORKSPACE: atelier report WORKSPACE");
  }
  const std::filesystem::path workspace =
      std::filesystem::path(arguments.workspace + "/").lexically_normal().parent_path();
  const std::filesystem::path page = arguments.out.empty() ? report_folder(workspace) / "index.html"
                                                           : std::filesystem::path(arguments.out);
  if (page.extension() != ".html") {
    throw UsageError("--out cannot be '" + arguments.out.substr(0, 80) +
                     "': it takes a name with .html");
  }
  require_outside_results(page, workspace, all_stages(), "--out");
  const std::vector<StageStatus> stages = write_report(workspace, page, options, arguments.truth);
  std::cout << printable(page.string()) << "\n";
  for (const StageStatus& status : stages) {
    if (status.manifest) {
      std::cout << status.stage << ": " << state_name(status.state)
                << ", consent: " << printable(to_string(status.manifest->consent)) << "\n";
      if (status.state == StageStatus::State::Damaged) {
        std::cout << "  error: its files are not what the stage wrote; run the stage again\n";
      }
      for (const Finding& finding : status.findings) {
        if (finding.code == "consent-ended" || finding.code == "consent-changed") {
          std::cout << "  warning: " << printable(finding.what) << "\n";
        }
      }
    } else if (status.state != StageStatus::State::None) {
      std::cout << status.stage << ": " << state_name(status.state) << "\n";
    }
  }
  return kExitDone;
}

}  // namespace

OptionSet report_options() {
  return option_set<ReportOptions>();
}

Action add_report(CLI::App& parser) {
  auto arguments = std::make_shared<ReportArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace, "Folder of results").required();
  add_option(parser, "--out", arguments->out, "Page to write [WORKSPACE/report/index.html]")
      .type_name("FILE");
  add_option(parser, "--ground-truth,--truth", arguments->truth,
             "Synthetic capture that the results were made from, for a section with their errors, "
             "as evaluate prints them")
      .type_name("CAPTURE");
  const OptionReader options = add_option_flags(parser, report_options());
  return [arguments, options] { return run(*arguments, options_of<ReportOptions>(options())); };
}

}  // namespace atelier
