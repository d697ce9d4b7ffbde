#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/finding.h"

namespace atelier {

/// Metadata of a text USD layer. Absent: USD's own default.
struct UsdLayer {
  std::optional<double> metres_per_unit;  ///< > 0
  std::string up_axis;                    ///< "Y", "Z" or "" where it is not said
  std::optional<double> fps;              ///< frames per second
  std::optional<double> first_frame;      ///< time code
  std::optional<double> last_frame;       ///< time code
  std::int64_t prims = 0;                 ///< outermost ones
  std::vector<Finding> findings;
};

/// Reads the frame of a .usda: "#usda 1.x", what is said of the layer in parentheses, then prims
/// (def, over, class; a type; a name in quotes; parentheses; braces). Throws DataError, with the
/// line, for another beginning, brackets, strings, paths or asset names that do not close or match,
/// anything else between prims, and what is said of the layer if it is no such number or axis. Of
/// the content of prims only brackets, strings and numbers are checked: a finding names the first
/// that is not finite.
UsdLayer parse_usda(std::string_view text, const std::string& file = "");

}  // namespace atelier
