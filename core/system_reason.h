#pragma once

#include <string>

namespace atelier {

/// What the system says of an errno and, where the user can do something about it, what to do: "No
/// space left on device; free space and run again".
std::string system_reason(int error);

}  // namespace atelier
