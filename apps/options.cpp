#include <iostream>
#include <memory>

#include "apps/arguments.h"
#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/stages.h"

namespace atelier {
namespace {

int run(bool markdown) {
  if (markdown) {
    std::cout << "# Options\n\nMade by `atelier options --markdown`. Give one as a flag "
                 "(`--section.field value`; of what is true or\nfalse, `--field` alone says true) "
                 "or in a TOML file named by `--config` (`[section]`,\n`field = value`); flags win "
                 "over files. A flag is shown with dashes (`--the-field`) where\nTOML has "
                 "underscores (`the_field = value`); either may be typed.\n";
  }
  const auto show = [&](std::string_view name, const OptionSet& options) {
    if (markdown) {
      std::cout << "\n## atelier " << name << "\n\n" << options_markdown(options.table);
    } else {
      std::cout << "atelier " << name << "\n" << options_help(options.table);
    }
  };
  for (const Stage& stage : all_stages()) {
    show(stage.name, stage.options());
  }
  for (const Command& command : all_commands()) {
    if (command.options != nullptr) {
      show(command.name, command.options());
    }
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
