#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/stage_command.h"
#include "apps/stages.h"
#include "apps/usage_error.h"

namespace atelier {
namespace {

/// "    status) words='--check --json' ;;" of the options that a command declares.
std::string flag_case(std::string_view name, const CLI::App& parser) {
  std::string words = "--help";
  for (const CLI::Option* option : parser.get_options()) {
    for (const std::string& flag : option->get_lnames()) {
      words += flag == "help" ? "" : " --" + flag;
    }
  }
  return "    " + std::string(name) + ") words='" + words + "' ;;\n";
}

std::string bash_script() {
  std::string commands;
  std::string cases;
  const auto add = [&](std::string_view name, const CLI::App& parser) {
    commands += (commands.empty() ? "" : " ") + std::string(name);
    cases += flag_case(name, parser);
  };
  for (const Stage& stage : all_stages()) {
    CLI::App parser;
    add_stage(parser, stage, stand_alone(stage.name));
    add(stage.name, parser);
  }
  for (const Command& command : all_commands()) {
    CLI::App parser;
    if (command.name != "completion") {  // which would ask itself without end
      command.add(parser);
    }
    add(command.name, parser);
  }
  return "# Completion for bash: source <(atelier completion bash)\n"
         "_atelier() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} words=\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    COMPREPLY=($(compgen -W '" +
         commands +
         " --help --version' -- \"$word\"))\n"
         "    return\n"
         "  fi\n"
         "  case ${COMP_WORDS[1]} in\n" +
         cases +
         "  esac\n"
         "  case ${COMP_WORDS[1]}:$word in\n"
         "    completion:*) COMPREPLY=($(compgen -W 'bash' -- \"$word\")) ;;\n"
         "    *:-*) COMPREPLY=($(compgen -W \"$words\" -- \"$word\")) ;;\n"
         "    *) COMPREPLY=($(compgen -f -- \"$word\")) ;;\n"
         "  esac\n"
         "}\n"
         "complete -o filenames -F _atelier atelier\n";
}

int run(const std::string& shell) {
  if (shell != "bash") {
    throw UsageError(
        "it takes the name of a shell, of which there is bash: atelier completion bash");
  }
  std::cout << bash_script();
  return kExitDone;
}

}  // namespace

Action add_completion(CLI::App& parser) {
  auto shell = std::make_shared<std::string>();
  parser.add_option("SHELL", *shell, "bash");
  return [shell] { return run(*shell); };
}

}  // namespace atelier
