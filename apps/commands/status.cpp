#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/stage_console.h"
#include "apps/console/standard_streams.h"
#include "core/exit_code.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/input_errors.h"
#include "core/store/workspace_folder.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

struct StatusArguments {
  std::string workspace;
  bool digests = false;
  bool check = false;
  bool json = false;
};

/// "" of a stage without a result, or whose result says nothing against its input.
std::string input_errors_of(const StageStatus& status) {
  return status.manifest && status.row != nullptr ? input_errors_text(*status.row, *status.manifest)
                                                  : "";
}

nlohmann::json json_of(const StageStatus& status) {
  nlohmann::json json = {{"stage", status.stage},
                         {"state", state_name(status.state)},
                         {"running", status.running},
                         {"reasons", status.reasons},
                         {"older_results", status.older_results},
                         {"older_kept", status.older_kept},
                         {"unlinked_results", status.unlinked_results}};
  json["unfinished"] = nlohmann::json::array();
  for (const UnfinishedWork& work : status.unfinished) {
    json["unfinished"].push_back({{"key", work.key16}, {"frames", work.frames}});
  }
  json["findings"] = nlohmann::json::array();
  for (const Finding& finding : status.findings) {
    json["findings"].push_back({{"severity", severity_name(finding.severity)},
                                {"code", finding.code},
                                {"place", finding.place},
                                {"what", finding.what},
                                {"advice", finding.advice}});
  }
  if (status.manifest) {
    json["key"] = hex(status.manifest->key);
    json["finished"] = status.manifest->finished;
    json["outputs"] = status.manifest->outputs.size();
    json["input_errors"] = input_errors_of(status);
    json["metrics"] = status.manifest->metrics;
    json["consent"] = to_string(status.manifest->consent);
  }
  return json;
}

void show(const StageStatus& status) {
  std::string name = status.stage;
  name.resize(std::max<std::size_t>(name.size() + 1, 14), ' ');
  std::cout << name << state_name(status.state)
            << (input_errors_of(status).empty() ? "" : ", with errors")
            << (status.running ? ", running now" : "");
  if (status.manifest) {
    std::int64_t bytes = 0;
    for (const ManifestOutput& output : status.manifest->outputs) {
      bytes += output.size;
    }
    std::cout << "  " << folder_name(status.manifest->key) << "  "
              << counted(static_cast<std::int64_t>(status.manifest->outputs.size()), "file") << ", "
              << bytes_text(static_cast<double>(bytes)) << ", finished "
              << printable(status.manifest->finished)
              << "\n    consent: " << printable(to_string(status.manifest->consent));
  }
  std::cout << "\n";
  if (const std::string errors = input_errors_of(status); !errors.empty()) {
    std::cout << "    " << errors << ": the capture has errors, or shows too little; what is made "
              << "of this result may be wrong\n";
  }
  for (const std::string& reason : status.reasons) {
    std::cout << "    " << printable(reason) << "\n";
  }
  for (const Finding& finding : status.findings) {
    std::cout << "    " << printable(to_string(finding)) << "\n";
  }
  for (const UnfinishedWork& work : status.unfinished) {
    std::cout << "    unfinished: " << work.key16 << " with " << counted(work.frames, "frame")
              << "\n";
  }
  const std::int64_t removable = status.older_results - status.older_kept;
  if (removable > 0) {
    std::cout << "    " << counted(removable, "older result") << "; atelier gc removes "
              << (removable == 1 ? "it" : "them") << "\n";
  }
  if (status.older_kept > 0) {
    std::cout << "    " << counted(status.older_kept, "older result") << "; atelier gc leaves "
              << (status.older_kept == 1 ? "it" : "them")
              << (status.state == StageStatus::State::Newer
                      ? " while the current one is a newer atelier's\n"
                  : status.state == StageStatus::State::Damaged
                      ? " while the current one is damaged\n"
                      : ", which a newer atelier wrote\n");
  }
  if (status.unlinked_results > 0) {
    std::cout << "    " << unlinked_text(status.unlinked_results) << "\n";
  }
}

int run(const StatusArguments& arguments) {
  if (arguments.workspace.empty()) {
    throw UsageError("status takes a WORKSPACE: atelier status WORKSPACE");
  }
  const std::vector<StageStatus> all = workspace_status(
      all_stages(), arguments.workspace, arguments.digests ? Check::Digests : Check::Sizes);
  bool sound = true;
  nlohmann::json json = nlohmann::json::array();
  for (const StageStatus& status : all) {
    sound = sound && status.state != StageStatus::State::Outdated &&
            status.state != StageStatus::State::Newer &&
            status.state != StageStatus::State::Damaged;
    if (arguments.json) {
      json.push_back(json_of(status));
    } else {
      show(status);
    }
  }
  if (arguments.json) {
    std::cout << json_text(json, 1) << "\n";
  }
  if (const std::string openness = openness_of(arguments.workspace); !openness.empty()) {
    (arguments.json ? standard_error() : std::cout) << "warning: " << printable(openness) << "\n";
  }
  return arguments.check && !sound ? kExitCheckFailed : kExitDone;
}

}  // namespace

Action add_status(CLI::App& parser) {
  auto arguments = std::make_shared<StatusArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace, "Folder of results").required();
  add_flag(parser, "--digests", arguments->digests,
           "Comparison of every byte instead of sizes only");
  add_flag(parser, "--check", arguments->check,
           "Exit code 1 if a result is damaged, outdated or newer");
  add_flag(parser, "--json", arguments->json, "Output as JSON, for programs");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
