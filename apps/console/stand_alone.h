#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "core/device.h"
#include "core/options.h"

namespace CLI {  // NOLINT(readability-identifier-naming): CLI11 has that name
class App;
}

namespace atelier {

/// Arguments of a stage's command besides the flags of its work without a workspace.
struct StandAloneRequest {
  std::string input;         ///< INPUT; empty: not given
  const OptionSet& options;  ///< of the stage
  Device device = Device::Cpu;
  bool json = false;
  std::string workspace = std::string();  ///< WORKSPACE, of work on a sealed one
  int jobs = 0;                           ///< frames at once; 0: as many as processors
};

/// Work without a workspace, or on a sealed one, its flags declared.
struct StandAloneWork {
  std::function<std::string()> given;  ///< the first of its flags that was given, "--html", or ""
  std::function<int(const StandAloneRequest& request)> run;  ///< returns the exit code
};

/// The work of a stage's command without a workspace, on files that flags name, or on a WORKSPACE
/// that is a sealed file, into which nothing can be written.
struct StandAlone {
  std::string_view stage;
  std::string_view first_flag;                        ///< "--garment": names this use in errors
  bool takes_input = false;                           ///< INPUT without WORKSPACE is its work too
  StandAloneWork (*add)(CLI::App& parser) = nullptr;  ///< declares the flags
  bool of_sealed = false;                             ///< it is work on a sealed WORKSPACE
};

/// Every stage's, beside all_commands.
std::span<const StandAlone> all_stand_alone();

/// The entry of the stage of that name, or null.
const StandAlone* stand_alone(std::string_view stage);

StandAloneWork add_animate_sealed(CLI::App& parser);  // only with animation and sealing
StandAloneWork add_validate_alone(CLI::App& parser);
StandAloneWork add_flatten_alone(CLI::App& parser);   // only with registration
StandAloneWork add_simulate_alone(CLI::App& parser);  // only with simulation and core_render

}  // namespace atelier
