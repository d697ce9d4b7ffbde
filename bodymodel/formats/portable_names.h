#pragma once

#include <string>
#include <vector>

namespace atelier {

/// Names of joints or markers that every reader takes, each once: characters other than ASCII
/// letters, digits, '_', '-' and '.' become '_', since blanks part words and ':' and '/' are paths
/// to some (three.js never turns such a joint); a name that is there already gets "_2", "_3", ...;
/// none is "joint".
std::vector<std::string> portable_names(const std::vector<std::string>& names);

}  // namespace atelier
