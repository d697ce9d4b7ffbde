#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/stage_console.h"
#include "core/exit_code.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/collect_garbage.h"
#include "core/store/result.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

struct GcArguments {
  std::string workspace;
  bool dry_run = false;
  bool json = false;
};

int run(const GcArguments& arguments) {
  if (arguments.workspace.empty()) {
    throw UsageError("gc takes a WORKSPACE: atelier gc WORKSPACE");
  }
  const std::vector<Garbage> all =
      collect_garbage(all_stages(), arguments.workspace, arguments.dry_run);
  const bool removes = std::any_of(all.begin(), all.end(),
                                   [](const Garbage& garbage) { return garbage.kept.empty(); });
  if (arguments.dry_run && removes) {
    require_folder_place(arguments.workspace);
  }
  nlohmann::json json = nlohmann::json::array();
  double freed = 0;
  for (const Garbage& garbage : all) {
    freed += garbage.removed ? static_cast<double>(garbage.bytes) : 0;
    if (arguments.json) {
      json.push_back({{"path", garbage.path.string()},
                      {"what", garbage.what},
                      {"bytes", garbage.bytes},
                      {"kept", garbage.kept},
                      {"removed", garbage.removed}});
    } else {
      const bool kept = !garbage.kept.empty();
      std::cout << (garbage.removed     ? "removed "
                    : arguments.dry_run ? (kept ? "would leave " : "would remove ")
                                        : "left ")
                << printable(garbage.path.string()) << ": " << garbage.what
                << (kept ? "; " + garbage.kept : "") << ", "
                << bytes_text(static_cast<double>(garbage.bytes)) << "\n";
    }
  }
  if (arguments.json) {
    std::cout << json_text(json, 1) << "\n";
    return kExitDone;
  }
  if (all.empty()) {
    std::cout << "nothing to remove\n";
  } else if (!arguments.dry_run) {
    std::cout << bytes_text(freed) << " freed\n";
  }
  for (const Stage& stage : all_stages()) {
    const std::filesystem::path folder = std::filesystem::path(arguments.workspace) / stage.name;
    if (const std::optional<Finding> problem = current_folder_finding(folder)) {
      std::cout << "left " << stage.name << ": " << printable(to_string(*problem)) << "\n";
    }
    const std::int64_t results = unlinked_results(folder);
    if (results > 0) {
      std::cout << "left " << stage.name << ": " << unlinked_text(results) << "\n";
    }
  }
  return kExitDone;
}

}  // namespace

Action add_gc(CLI::App& parser) {
  auto arguments = std::make_shared<GcArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace, "Folder of results").required();
  add_flag(parser, "--dry-run", arguments->dry_run,
           "Report what would be removed, without removing it");
  add_flag(parser, "--json", arguments->json, "Output as JSON, for programs");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
