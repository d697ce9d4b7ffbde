#pragma once

#include <string>

namespace atelier {

/// "atelier 0.1.0, gcc 12.2.0, optimised": what made a result; kept in its manifest.
std::string build_info();

}  // namespace atelier
