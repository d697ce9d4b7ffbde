#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/stages.h"

namespace atelier {
namespace {

int run(bool markdown) {
  if (markdown) {
    std::cout << "# Options\n\nMade by `atelier options --markdown`. Give one as a flag "
                 "(`--section.field value`) or in a TOML file\nnamed by `--config` (`[section]`, "
                 "`field = value`); flags win over files.\n";
  }
  for (const Stage& stage : all_stages()) {
    const StageOptions options = stage.options();
    if (markdown) {
      std::cout << "\n## atelier " << stage.name << "\n\n" << options_markdown(options.table);
    } else {
      std::cout << "atelier " << stage.name << "\n" << options_help(options.table);
    }
  }
  return kExitDone;
}

}  // namespace

Action add_options(CLI::App& parser) {
  auto markdown = std::make_shared<bool>(false);
  parser.add_flag("--markdown", *markdown, "As docs/options.md");
  return [markdown] { return run(*markdown); };
}

}  // namespace atelier
