#pragma once

#include <string>
#include <vector>

namespace atelier {

/// Consent of a recorded person. It is copied from the capture into the manifest of everything made
/// from it, so that limited access can be kept.
struct Consent {
  std::string who;    ///< the person, by name or pseudonym
  std::string scope;  ///< what the recording may be used for
  std::string until;  ///< last day, "2030-12-31", or "" for no end
  /// List of revoked consents: a file, or an address (https://); "" where there is none.
  std::string revocation = std::string();
  /// Who signed it: an Ed25519 public key, "RW..."; "" where nobody has (core/seal/minisign.h).
  std::string key = std::string();
  std::string signature = std::string();  ///< of `consent_statement`, in one line

  bool operator==(const Consent&) const = default;
};

/// The text that a signature of a consent signs: a line for each field but those of the signature.
std::string consent_statement(const Consent& consent);

/// "P. Doe, research, until 2030-12-31, signed by RWQ..."; "none recorded" for an empty list.
std::string to_string(const std::vector<Consent>& consent);

/// Adds those of `more` that are not in `all`.
void add_consent(std::vector<Consent>& all, const std::vector<Consent>& more);

/// One sentence for each whose last day (UTC) is over. @param now  seconds since 1970
std::vector<std::string> ended_consent(const std::vector<Consent>& consent, double now);

}  // namespace atelier
