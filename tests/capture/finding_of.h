#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/finding.h"

namespace atelier::fixtures {

/// The first finding of that code, or null.
inline const Finding* finding_of(const std::vector<Finding>& findings, const std::string& code) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const Finding& finding) { return finding.code == code; });
  return found == findings.end() ? nullptr : &*found;
}

}  // namespace atelier::fixtures
