#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "core/finding.h"
#include "core/options.h"
#include "core/store/consent.h"

namespace atelier {

/// Permitted uses of a likeness, as the scope of a consent states them: "research and publication".
/// `internal`: shown to nobody outside of the group that made the capture.
inline constexpr std::array<std::string_view, 4> kPurposes = {"research", "internal", "publication",
                                                              "product"};

/// One use of what was made of a person.
struct ConsentUse {
  std::string purpose = "research";  ///< one of kPurposes
  std::string revoked;  ///< file: a list of revoked consents, besides those that consents name
};

OptionTable describe(ConsentUse& use);

/// Verdict of consents on a use.
struct ConsentAnswer {
  std::vector<std::string> refusals;  ///< why it is refused, a sentence each, with what to do
  std::vector<std::string> doubts;    ///< what could not be judged
};

/// Asks each consent: its last day, its signature where it has one, its scope, its revocation list.
/// A scope with none of the words of kPurposes and without "any" is free text, which nobody can
/// judge: a doubt. A list that a consent names and that is not there is a refusal; one at an
/// address (https://) is a doubt unless `revoked` is given.
/// @param now  seconds since 1970
ConsentAnswer ask_consent(const std::vector<Consent>& consent, const ConsentUse& use, double now);

/// What consents of a capture say to a use, besides what its own checks tell (capture/validate.h:
/// the last day, the signature): a warning where it is out of scope or a list cannot be read, an
/// error where it was revoked, a note where a list at an address was not asked.
std::vector<Finding> consent_findings(const std::vector<Consent>& consent, const ConsentUse& use,
                                      const std::string& place);

/// Throws ConsentRefused where a consent refuses the use today; else returns the doubts.
std::vector<std::string> require_consent(const std::vector<Consent>& consent,
                                         const ConsentUse& use);

/// 16 hexadecimal digits that name a consent in a revocation list: the first of the SHA-256 of who,
/// scope and until.
std::string consent_id(const Consent& consent);

/// The ids of a revocation list: one a line, followed by whatever a reader may want to know; empty
/// lines and comments (#) are passed over. Throws DataError for any other line.
std::vector<std::string> parse_revocations(std::string_view text, const std::string& file);

}  // namespace atelier
