#pragma once

#include <string>
#include <vector>

#include "core/options.h"

namespace atelier {

/// A stage or command that takes options.
struct OptionOwner {
  std::string name;   ///< "reconstruct"
  OptionTable table;  ///< the caller keeps alive what it points into
};

/// The Markdown sections of the reference of options. Options that several owners take under one
/// name, range, unit and help, under whatever prefix, are printed once, under "Common options";
/// each owner's section links there, says under which prefix they are its own and which of its
/// defaults differ, and lists the others. Groups of one row alone are left where they are.
std::string options_reference(const std::vector<OptionOwner>& owners);

}  // namespace atelier
