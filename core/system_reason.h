#pragma once

#include <string>

namespace atelier {

/// The system's message for an errno and, where the user can do something about it, advice: "No
/// space left on device; free space and run again".
std::string system_reason(int error);

}  // namespace atelier
