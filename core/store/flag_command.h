#pragma once

#include <string>
#include <string_view>

#include "core/options.h"

namespace atelier {

/// A message of a stage in which every flag can be typed: options of the stage that it names
/// ("--thickness", by the whole name or a last part that no other option has) are said in full,
/// with the command that takes them so and as `atelier run` does, whose flags begin with the
/// stage: "more --solver.thickness (atelier simulate; in atelier run --simulate.solver.thickness)".
/// Flags of the capture ("--capture.fps"), which both take, and those behind the name of another
/// command ("atelier template --frame 3") stay as they are.
/// @param table  the options of the stage
std::string with_command(const std::string& message, std::string_view stage,
                         const OptionTable& table);

}  // namespace atelier
