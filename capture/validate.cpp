#include "capture/validate.h"

#include <algorithm>
#include <chrono>

#include "capture/check_cameras.h"
#include "capture/check_keypoints.h"
#include "core/store/consent.h"

namespace atelier {
namespace {

std::vector<Finding> check_consent(const Dataset& dataset) {
  if (dataset.info.consent.empty()) {
    return {{Severity::Warning, "consent-none", dataset.root.string(), "no consent is recorded",
             "state who, scope and until in the [consent] of capture.toml"}};
  }
  const double now =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  std::vector<Finding> findings;
  for (const std::string& ended : ended_consent(dataset.info.consent, now)) {
    findings.push_back({Severity::Warning, "consent-ended", dataset.root.string(), ended,
                        "ask for it anew, or remove the capture"});
  }
  return findings;
}

}  // namespace

OptionTable describe(ValidateOptions& options) {
  OptionTable table;
  table.add("frames", describe(options.frames));
  table.add("keypoints", describe(options.keypoints));
  return table;
}

std::vector<Finding> validate(FrameReader& reader, const ValidateOptions& options,
                              const std::function<void(int done, int total)>& told) {
  const Dataset& dataset = reader.dataset();
  std::vector<Finding> findings = dataset.findings;
  const auto add = [&](const std::vector<Finding>& more) {
    findings.insert(findings.end(), more.begin(), more.end());
  };
  add(check_consent(dataset));
  if (dataset.calibrated) {
    add(check_cameras(dataset.cameras));
  }
  add(check_frames(reader, options.frames, told));
  add(check_keypoints(reader, options.keypoints));
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    return static_cast<int>(a.severity) > static_cast<int>(b.severity);
  });
  return findings;
}

}  // namespace atelier
