#pragma once

#include <span>
#include <string>

#include "capture/layouts/layout.h"

namespace atelier {

/// Every layout; where several are recognised, the first is taken.
std::span<const Layout> all_layouts();

/// By name. Throws LogicError if there is none.
const Layout& find_layout(const std::string& name);

}  // namespace atelier
