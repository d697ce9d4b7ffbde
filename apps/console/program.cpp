#include "apps/console/program.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>

#include "apps/console/command.h"
#include "apps/console/failure.h"
#include "apps/console/option_flags.h"
#include "apps/console/stage_command.h"
#include "apps/console/stage_console.h"
#include "apps/console/stand_alone.h"
#include "apps/console/standard_streams.h"
#include "core/exit_code.h"
#include "core/nearest_name.h"
#include "core/renamed_options.h"
#include "core/split_text.h"
#include "core/store/build_info.h"
#include "core/usage_error.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

std::string row(std::string_view name, std::string_view summary, std::size_t name_width) {
  std::string line = "  " + std::string(name);
  line.resize(name_width + 4, ' ');
  return line + std::string(summary) + "\n";
}

std::string help() {
  std::size_t width = 0;
  for (const Stage& stage : all_stages()) {
    width = std::max(width, stage.name.size());
  }
  for (const Command& command : all_commands()) {
    width = std::max(width, command.name.size());
  }
  std::string text =
      "atelier: a multi-view capture of a clothed person becomes an avatar whose clothing is "
      "simulated\n\nUsage: atelier COMMAND ...        (atelier COMMAND --help says more)\n\n"
      "Stages, in their order: atelier STAGE INPUT WORKSPACE --section.field value\n";
  for (const Stage& stage : all_stages()) {
    text += row(stage.name, stage.summary, width);
  }
  text += "\nCommands:\n";
  for (const Command& command : all_commands()) {
    text += row(command.name, command.summary, width);
  }
  return text + "\n" + kExitCodeHelp;
}

std::vector<std::string> option_names(const CLI::App& parser) {
  std::vector<std::string> names;
  for (const CLI::Option* option : parser.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      names.push_back("--" + name);
    }
  }
  return names;
}

/// What an unknown option may mean: any but those of a solver, say, beside the one that was chosen.
/// Beside --solver A, options B.* of another solver are none.
std::vector<std::string> likely_names(const CLI::App& parser) {
  std::vector<std::string> names = option_names(parser);
  for (const std::string& name : option_names(parser)) {
    const CLI::Option* option = parser.get_option_no_throw(name);
    const std::size_t dot = name.rfind('.');
    const std::string start = dot == std::string::npos ? "--" : name.substr(0, dot + 1);
    for (const std::string& choice : split_text(option->get_type_name(), '|')) {
      std::erase_if(names, [&](const std::string& other) {
        return option->count() > 0 && option->results().back() != choice &&
               other.starts_with(start + choice + ".");
      });
    }
  }
  return names;
}

/// "; see atelier --help", after a question a sentence of its own.
std::string see(const std::string& question, const std::string& where) {
  return question + (question.empty() ? "; see " : " See ") + where;
}

/// The option of a parser that is called so with or without ".name": a material has one and is one.
std::string with_or_without_name(const CLI::App& parser, const std::string& option) {
  constexpr std::string_view kName = ".name";
  const std::string other = option.ends_with(kName) ? option.substr(0, option.size() - kName.size())
                                                    : option + std::string(kName);
  return parser.get_option_no_throw(other) != nullptr ? other : "";
}

/// Why a command has no such option where others would, or "".
std::string why_not(const std::string& command, const std::string& option) {
  const auto is_named = [&](const auto& row) { return "--" + std::string(row.name) == option; };
  if (std::any_of(all_stages().begin(), all_stages().end(), is_named) ||
      std::any_of(all_commands().begin(), all_commands().end(), is_named)) {
    const std::string name = option.substr(2);
    return ": " + name + " is a command of its own; see atelier " + name + " --help";
  }
  const Stage* stage = find_stage(all_stages(), command);
  if (stage != nullptr && !stage->frame_wise && (option == "--frames" || option == "--shard")) {
    return ": it works on all frames together; see atelier " + command + " --help";
  }
  return "";
}

constexpr const char* kNeural = "render-neural";  // typed as "render --neural"

/// A command as it is typed.
std::string typed_name(const CLI::App& parser) {
  return parser.get_name() == kNeural ? "render --neural" : parser.get_name();
}

/// Refuses what a command did not understand, in one sentence.
void refuse_extras(const CLI::App& parser, const std::vector<std::string>& arguments) {
  const std::vector<std::string> extras = parser.remaining();
  const auto first = std::find_if(extras.begin(), extras.end(),
                                  [](const std::string& extra) { return extra != "--"; });
  if (first == extras.end()) {
    return;  // "--" itself only says that what follows are no options
  }
  const std::string& extra = *first;
  const std::string name = typed_name(parser);
  const std::string shown = "'" + extra.substr(0, 60) + "'";
  if (extra.starts_with("-")) {
    const std::string option = extra.substr(0, extra.find('='));
    if (const std::string other = with_or_without_name(parser, option); !other.empty()) {
      throw UsageError(name + " has no option " + shown +
                       see(", did you mean '" + other + "'?", "atelier " + name + " --help"));
    }
    if (parser.get_option_no_throw(option) != nullptr) {
      throw UsageError(name + " takes no " + shown +
                       " behind '--', where nothing is an option: put it before");
    }
    const std::string why = why_not(parser.get_name(), option);
    throw UsageError(name + " has no option " + shown +
                     (why.empty() ? see(did_you_mean(option, likely_names(parser)),
                                        "atelier " + name + " --help")
                                  : why));
  }
  if (const std::string flag = switch_before(parser, arguments, extra); !flag.empty()) {
    throw UsageError(flag + " cannot be " + shown + ": it takes true or false, or nothing");
  }
  const auto options = parser.get_options();
  const bool takes_some = std::any_of(options.begin(), options.end(),
                                      [](const auto* option) { return option->get_positional(); });
  throw UsageError(name + " does not take " + shown + (takes_some ? " as well" : "") +
                   "; see atelier " + name + " --help");
}

/// Runs what a command declared. An error is told to machines that asked for JSON, but for a wrong
/// command line, and thrown on to main.
int act(const CLI::App& command, const Action& action) {
  try {
    return action();
  } catch (const std::exception& error) {
    const Failure failure = failure_of(error);
    const CLI::Option* json = command.get_option_no_throw("--json");
    if (failure.exit_code != kExitUsage && json != nullptr && json->count() > 0 &&
        json->as<bool>()) {
      const bool stage = find_stage(all_stages(), command.get_name()) != nullptr;
      show_error_event(stage ? "stage" : "command", command.get_name(), failure);
    }
    throw;
  }
}

/// The arguments with the present name of a command that was renamed, of which a warning speaks,
/// and with "render --neural" as the command that it is, "render-neural".
std::vector<std::string> with_present_command(std::vector<std::string> arguments,
                                              const std::map<std::string, Action>& actions) {
  std::string& command = arguments[0];
  if (const std::string now = renamed_stage(command);
      !actions.contains(command) && actions.contains(now)) {
    const std::string typed = now == kNeural ? "render --neural" : now;
    standard_error() << "warning: 'atelier " << command << "' is now 'atelier " << typed << "'\n";
    command = now;
  }
  const auto end = std::find(arguments.begin(), arguments.end(), "--");
  const auto flag = std::find(arguments.begin(), end, "--neural");
  if (command == "render" && flag != end && actions.contains(kNeural)) {
    arguments.erase(flag);
    arguments[0] = kNeural;
  }
  return arguments;
}

}  // namespace

int run_program(std::vector<std::string> arguments) {
  const auto asks_for_help = [](const std::string& word) {
    return word == "--help" || word == "-h" || word == "help";
  };
  const std::size_t most = !arguments.empty() && arguments[0] == "help" ? 2 : 1;
  if (arguments.size() > most && (asks_for_help(arguments[0]) || arguments[0] == "--version")) {
    throw UsageError(arguments[0] + " takes nothing more, not '" + arguments[most].substr(0, 60) +
                     "'; see atelier --help");
  }
  if (arguments.size() == 2 && arguments[0] == "help" && !asks_for_help(arguments[1])) {
    arguments = {arguments[1], "--help"};
  }
  if (arguments.empty() || asks_for_help(arguments[0])) {
    std::cout << help();
    return arguments.empty() ? kExitUsage : kExitDone;
  }
  if (arguments[0] == "--version") {
    std::cout << build_info() << "\n";
    return kExitDone;
  }
  CLI::App parser;
  std::map<std::string, Action> actions;
  const auto add = [&](std::string_view name, std::string_view summary) {
    CLI::App* command = parser.add_subcommand(std::string(name), std::string(summary));
    command->allow_extras();
    command->footer(kExitCodeHelp);
    return command;
  };
  for (const Stage& stage : all_stages()) {
    actions[std::string(stage.name)] =
        add_stage(*add(stage.name, stage.summary), stage, stand_alone(stage.name));
  }
  for (const Command& command : all_commands()) {
    actions[std::string(command.name)] = command.add(*add(command.name, command.summary));
  }
  arguments = with_present_command(std::move(arguments), actions);
  const auto action = actions.find(arguments[0]);
  if (action == actions.end()) {
    if (std::ranges::count(split_text(commands_left_out(), ' '), arguments[0]) > 0) {
      throw UsageError("this build of atelier leaves out the command '" + arguments[0] +
                       "'; cmake --preset release builds all of them");
    }
    std::vector<std::string> names = {"--help", "--version"};
    names.reserve(names.size() + actions.size());
    for (const auto& known : actions) {
      names.push_back(known.first);
    }
    const bool option = arguments[0].starts_with("-");
    std::string meant = did_you_mean(arguments[0], names);
    if (option && meant.empty()) {  // one of the command's, in the wrong place
      const auto command = std::find_if(arguments.begin(), arguments.end(),
                                        [&](const auto& word) { return actions.contains(word); });
      if (command != arguments.end()) {
        const std::string name = nearest_name(arguments[0].substr(0, arguments[0].find('=')),
                                              option_names(*parser.get_subcommand(*command)));
        meant = name.empty() ? "" : ", did you mean 'atelier " + *command + " " + name + "'?";
      }
    }
    throw UsageError(std::string("there is no ") + (option ? "option" : "command") + " '" +
                     arguments[0].substr(0, 60) + "'" + (option ? " before the command" : "") +
                     see(meant, "atelier --help"));
  }
  CLI::App* command = parser.get_subcommand(action->first);
  std::vector<std::string> rest = with_switches(*command, {arguments.begin() + 1, arguments.end()});
  std::reverse(rest.begin(), rest.end());  // CLI11 wants it so
  if (std::find(rest.begin(), rest.end(), "--help") != rest.end() ||
      std::find(rest.begin(), rest.end(), "-h") != rest.end()) {
    std::cout << command->help("atelier");
    return kExitDone;
  }
  // Required options are marked for the help; the commands' own sentences say what is missing.
  for (CLI::Option* option : command->get_options()) {
    option->required(false);
  }
  command->parse(rest);
  refuse_extras(*command, arguments);
  return act(*command, action->second);
}

}  // namespace atelier
