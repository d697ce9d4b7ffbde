#include "capture/validate.h"

#include <algorithm>
#include <chrono>

#include "capture/check_cameras.h"
#include "capture/check_keypoints.h"
#include "capture/check_labels.h"
#include "core/store/consent.h"

namespace atelier {
namespace {

std::vector<Finding> check_consent(const Dataset& dataset) {
  if (dataset.info.consent.empty()) {
    return {{Severity::Warning, "consent-none", dataset.root.string(), "no consent is recorded",
             "state who, scope and until in a [[consent]] of capture.toml"}};
  }
  const double now =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  std::vector<Finding> findings;
  for (const std::string& ended : ended_consent(dataset.info.consent, now)) {
    findings.push_back({Severity::Warning, "consent-ended", dataset.root.string(), ended,
                        "renew the consent, or remove the capture"});
  }
  return findings;
}

/// Joins findings of two checks on one place; a camera that the keypoints explain is not judged by
/// its direction of view as well.
void merge(std::vector<Finding>& findings) {
  const auto explained = [&](const std::string& place) {
    return std::any_of(findings.begin(), findings.end(), [&](const Finding& finding) {
      return finding.place == place &&
             (finding.code.starts_with("extrinsic-") || finding.code == "camera-unit" ||
              finding.code == "intrinsics-scale" || finding.code == "principal-point-swapped");
    });
  };
  std::vector<Finding> kept;
  for (const Finding& finding : findings) {
    const bool guess = finding.code == "camera-looks-away" || finding.code == "cameras-apart" ||
                       finding.code == "camera-focal" || finding.code == "camera-principal-point";
    const bool twice = std::any_of(kept.begin(), kept.end(), [&](const Finding& other) {
      return other.code == finding.code &&
             (other.place == finding.place || other.place.starts_with(finding.place + " "));
    });
    if (!twice && !(guess && (explained(finding.place) || explained("")))) {
      kept.push_back(finding);
    }
  }
  findings = std::move(kept);
}

}  // namespace

std::vector<std::string> settings_of(const std::vector<Finding>& findings) {
  // "--capture.sync cam3=2" and "--capture.sync cam5=1" are one setting of two cameras.
  std::vector<std::pair<std::string, std::string>> settings;
  for (const Finding& finding : findings) {
    const std::size_t space = finding.setting.find(' ');
    if (space == std::string::npos) {
      continue;
    }
    const std::string option = finding.setting.substr(0, space);
    const std::string value = finding.setting.substr(space + 1);
    const auto same = std::find_if(settings.begin(), settings.end(),
                                   [&](const auto& setting) { return setting.first == option; });
    const bool listed = value.find('=') != std::string::npos || option == "--capture.leave-out";
    if (same == settings.end()) {
      settings.emplace_back(option, value);
    } else if (listed && same->second.find(value) == std::string::npos) {
      same->second += "," + value;
    }
  }
  std::vector<std::string> lines;
  lines.reserve(settings.size());
  for (const auto& [option, value] : settings) {
    lines.emplace_back(option).append(" ").append(value);
  }
  return lines;
}

OptionTable describe(ValidateOptions& options) {
  OptionTable table;
  table.add("frames", describe(options.frames));
  table.add("keypoints", describe(options.keypoints));
  return table;
}

Validation validate(FrameReader& reader, const ValidateOptions& options,
                    const std::function<void(int done, int total)>& told) {
  const Dataset& dataset = reader.dataset();
  Validation validation;
  std::vector<Finding>& findings = validation.findings;
  findings = dataset.findings;
  const auto add = [&](const std::vector<Finding>& more) {
    findings.insert(findings.end(), more.begin(), more.end());
  };
  add(check_consent(dataset));
  if (dataset.calibrated) {
    add(check_cameras(dataset.cameras, dataset.file_world));
  }
  add(check_frames(reader, options.frames, told));
  validation.keypoints = check_keypoints(reader, options.keypoints);
  add(validation.keypoints.findings);
  add(check_labels(reader, validation.keypoints));
  merge(findings);
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    return static_cast<int>(a.severity) > static_cast<int>(b.severity);
  });
  return validation;
}

}  // namespace atelier
