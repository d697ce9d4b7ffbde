#pragma once

#ifdef ATELIER_HAS_CAPTURE

#include <map>
#include <string>

#include "core/device.h"
#include "core/options.h"

namespace atelier {

/// `atelier validate CAPTURE` without a workspace: prints what was found, as text or JSON, and
/// writes the page that "html" names. `values` has "INPUT". Returns kExitBadData for errors.
int validate_alone(const std::map<std::string, std::string>& values, const OptionSet& options,
                   Device device, bool json);

}  // namespace atelier

#endif
