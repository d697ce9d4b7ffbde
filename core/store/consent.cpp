#include "core/store/consent.h"

#include <algorithm>

#include "core/store/utc_time.h"

namespace atelier {

std::string consent_statement(const Consent& consent) {
  return "consent to the use of a likeness\nwho: " + consent.who + "\nscope: " + consent.scope +
         "\nuntil: " + consent.until + "\nrevocation: " + consent.revocation + "\n";
}

std::string to_string(const std::vector<Consent>& consent) {
  std::string text;
  for (const Consent& one : consent) {
    text += (text.empty() ? "" : "; ") + one.who + ", " + one.scope +
            (one.until.empty() ? "" : ", until " + one.until) +
            (one.signature.empty() ? "" : ", signed by " + one.key);
  }
  return text.empty() ? "none recorded" : text;
}

void add_consent(std::vector<Consent>& all, const std::vector<Consent>& more) {
  for (const Consent& one : more) {
    if (std::find(all.begin(), all.end(), one) == all.end()) {
      all.push_back(one);
    }
  }
}

std::vector<std::string> ended_consent(const std::vector<Consent>& consent, double now) {
  constexpr double kDay = 86400;
  std::vector<std::string> ended;
  for (const Consent& one : consent) {
    const auto last_day = seconds_of_utc(one.until + "T00:00:00Z");
    if (last_day && now >= *last_day + kDay) {
      ended.push_back("the consent of " + one.who + " (" + one.scope + ") ended with " + one.until);
    }
  }
  return ended;
}

}  // namespace atelier
