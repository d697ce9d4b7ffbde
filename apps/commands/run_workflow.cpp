#include "apps/commands/run_workflow.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include <unistd.h>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kThisMachine = "local";
constexpr int kThreadsOfJob = 2;  // as `atelier plan` has it

/// share/atelier of the prefix, or of the build folder, in which this program lies.
fs::path workflow_file(const fs::path& program) {
  const fs::path file =
      program.parent_path().parent_path() / "share" / "atelier" / "workflow" / "Snakefile";
  if (!fs::exists(file)) {
    throw EnvironmentError(file.string(), "is missing; it is installed with the program");
  }
  return file;
}

}  // namespace

void run_workflow(const RunArguments& arguments, std::vector<std::string> options) {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  const fs::path workspace = fs::absolute(arguments.places.workspace);
  const fs::path notes = workspace.string() + ".workflow";
  // Snakemake reads the values of --config as YAML, of which JSON is a part.
  std::vector<std::string> config;
  const auto add = [&](const char* name, const nlohmann::json& value) {
    config.push_back(std::string(name) + "=" + value.dump());
  };
  const int cores = thread_count();
  add("capture", fs::absolute(arguments.places.capture).string());
  add("workspace", workspace.string());
  add("program", nlohmann::json::array({program.string()}));
  add("threads", std::min(cores, kThreadsOfJob));
  add("device", arguments.device);
  if (!arguments.from.empty()) {
    add("from", arguments.from);
  }
  if (!arguments.to.empty()) {
    add("to", arguments.to);
  }
  if (!arguments.material.empty()) {
    options.insert(options.end(), {"--material", arguments.material});
  }
  add("options", options);

  std::vector<std::string> words = {"snakemake", "--snakefile", workflow_file(program).string(),
                                    "--directory", notes.string()};
  if (arguments.workflow == kThisMachine) {
    words.insert(words.end(), {"--cores", std::to_string(cores)});
  } else {
    words.insert(words.end(), {"--profile", arguments.workflow});
  }
  if (arguments.dry_run) {
    words.emplace_back("--dry-run");
  }
  words.emplace_back("--config");
  words.insert(words.end(), config.begin(), config.end());
  std::vector<char*> pointers;
  for (std::string& word : words) {
    pointers.push_back(word.data());
  }
  pointers.push_back(nullptr);
  fs::create_directories(notes);
  execvp(pointers[0], pointers.data());
  throw EnvironmentError("snakemake", std::string("cannot be run (") +
                                          std::generic_category().message(errno) +
                                          "); Debian's package snakemake has it");
}

}  // namespace atelier
