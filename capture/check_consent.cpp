#include "capture/check_consent.h"

#include <ctime>

#include "core/store/consent.h"

namespace atelier {

std::vector<Finding> check_ended_consent(const Dataset& dataset) {
  std::vector<Finding> findings;
  for (const std::string& ended :
       ended_consent(dataset.info.consent, static_cast<double>(std::time(nullptr)))) {
    findings.push_back({Severity::Warning, "consent-ended", dataset.root.string(), ended,
                        "renew the consent, or remove the capture"});
  }
  return findings;
}

}  // namespace atelier
