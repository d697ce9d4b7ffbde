#include <iostream>
#include <memory>
#include <vector>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "core/exit_code.h"
#include "core/options_reference.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

constexpr std::string_view kHead =
    "# Options\n\nMade by `atelier options --markdown`. Give an option as a flag "
    "(`--section.field value`; of what is true or\nfalse, `--field` alone says true) or in a TOML "
    "file named by `--config` (`[section]`,\n`field = value`); flags win over files. A flag is "
    "shown with dashes (`--the-field`) where\nTOML has underscores (`the_field = value`); either "
    "may be typed. `atelier run` takes the options\nof its stages behind their names "
    "(`--track.section.field value`). Flags that every stage takes are\nin "
    "[commands.md](commands.md#stages).\n";

int run(bool markdown) {
  std::vector<OptionSet> sets;
  std::vector<OptionOwner> owners;
  const auto add = [&](std::string_view name, OptionSet options) {
    owners.push_back({std::string(name), options.table});
    sets.push_back(std::move(options));  // what the tables point into
  };
  for (const Stage& stage : all_stages()) {
    add(stage.name, stage.options());
  }
  for (const Command& command : all_commands()) {
    if (command.options != nullptr) {
      add(command.name, command.options());
    }
  }
  if (markdown) {
    std::cout << kHead << options_reference(owners);
    return kExitDone;
  }
  for (const OptionOwner& owner : owners) {
    std::cout << "atelier " << owner.name << "\n" << options_help(owner.table);
  }
  return kExitDone;
}

}  // namespace

Action add_options(CLI::App& parser) {
  auto markdown = std::make_shared<bool>(false);
  add_flag(parser, "--markdown", *markdown, "Output as Markdown, for the reference of options");
  return [markdown] { return run(*markdown); };
}

}  // namespace atelier
