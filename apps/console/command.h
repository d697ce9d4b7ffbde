#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "core/options.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11 has that name
class App;
}

namespace atelier {

/// The function of a command, called once its arguments are parsed; returns the exit code.
using Action = std::function<int()>;

/// One row of the table of commands. `add` declares arguments on the parser and gives back the
/// action that uses them.
struct Command {
  std::string_view name;
  std::string_view summary;
  Action (*add)(CLI::App& parser);
  OptionSet (*options)() = nullptr;  ///< their defaults, of a command that has some
};

/// Every command that is not a stage, in the order of --help.
std::span<const Command> all_commands();

/// Names of the commands that this build leaves out (cmake/Targets.cmake), with spaces between.
std::string_view commands_left_out();

OptionSet convert_options();
OptionSet convert_capture_options();
OptionSet calibrate_options();
OptionSet calibrate_color_options();
OptionSet depth_options();
OptionSet masks_options();
OptionSet detect_options();
OptionSet render_options();
OptionSet draw_options();
OptionSet body_model_options();
OptionSet drape_options();
OptionSet synthesize_options();
OptionSet export_options();
OptionSet report_options();
OptionSet seal_options();
OptionSet verify_options();
OptionSet view_options();

Action add_run(CLI::App& parser);   // only with capture
Action add_plan(CLI::App& parser);  // only with capture
Action add_status(CLI::App& parser);
Action add_inspect(CLI::App& parser);
Action add_gc(CLI::App& parser);
Action add_convert(CLI::App& parser);
Action add_convert_capture(CLI::App& parser);
Action add_calibrate(CLI::App& parser);
Action add_calibrate_color(CLI::App& parser);
Action add_depth(CLI::App& parser);
Action add_masks(CLI::App& parser);
Action add_detect(CLI::App& parser);
Action add_render(CLI::App& parser);  // only with core_render
Action add_draw(CLI::App& parser);
Action add_body_model(CLI::App& parser);
Action add_drape(CLI::App& parser);
Action add_synthesize(CLI::App& parser);
Action add_evaluate(CLI::App& parser);
Action add_export(CLI::App& parser);
Action add_report(CLI::App& parser);
Action add_key(CLI::App& parser);
Action add_seal(CLI::App& parser);
Action add_sign(CLI::App& parser);
Action add_unseal(CLI::App& parser);
Action add_verify(CLI::App& parser);
Action add_view(CLI::App& parser);
Action add_options(CLI::App& parser);
Action add_completion(CLI::App& parser);

}  // namespace atelier
