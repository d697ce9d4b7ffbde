#include "core/finding.h"

#include <algorithm>

namespace atelier {
namespace {

/// All of it but the severity.
std::string described(const Finding& finding) {
  std::string text = finding.code;
  if (!finding.place.empty()) {
    text += " [" + finding.place + "]";
  }
  text += ": " + finding.what;
  if (!finding.advice.empty()) {
    text += "; " + finding.advice;
  }
  if (!finding.setting.empty()) {
    text += " -> " + finding.setting;
  }
  return text;
}

}  // namespace

const char* severity_name(Severity severity) {
  switch (severity) {
    case Severity::Note:
      return "note";
    case Severity::Warning:
      return "warning";
    case Severity::Error:
      return "error";
  }
  return "note";
}

bool has_errors(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& finding) { return finding.severity == Severity::Error; });
}

std::string to_string(const Finding& finding) {
  return severity_name(finding.severity) + (" " + described(finding));
}

std::string warning_text(const Finding& finding) {
  return finding.severity == Severity::Warning ? described(finding) : to_string(finding);
}

}  // namespace atelier
