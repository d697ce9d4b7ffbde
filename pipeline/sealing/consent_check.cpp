#include "pipeline/sealing/consent_check.h"

#include <algorithm>
#include <ctime>
#include <filesystem>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/seal/minisign.h"
#include "core/sha256.h"
#include "core/split_text.h"
#include "core/store/consent_refused.h"

namespace atelier {
namespace {

constexpr std::size_t kIdDigits = 16;

/// The words of a scope in lower case.
std::vector<std::string> scope_words(const std::string& scope) {
  std::vector<std::string> words(1);
  for (const char c : scope) {
    const char lower = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (lower >= 'a' && lower <= 'z') {
      words.back() += lower;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  return words;
}

bool has(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string named(const Consent& consent) {
  return "the consent of " + consent.who + " (" + consent.scope + ")";
}

/// What a consent says to a use, why, and what to do.
struct ConsentReason {
  std::string code;  ///< of a finding
  std::string what;
  std::string advice;
};

struct ConsentReasons {
  std::vector<ConsentReason> refusals;
  std::vector<ConsentReason> doubts;
};

void ask_scope(const Consent& consent, const std::string& purpose, ConsentReasons& reasons) {
  const std::vector<std::string> words = scope_words(consent.scope);
  if (has(words, "any") || has(words, purpose)) {
    return;
  }
  const bool judged = std::any_of(kPurposes.begin(), kPurposes.end(),
                                  [&](std::string_view word) { return has(words, word); });
  if (judged) {
    reasons.refusals.push_back({"consent-scope", named(consent) + " does not cover " + purpose,
                                "name another --purpose, or renew the consent with that word in "
                                "its scope and run the stages again"});
  } else {
    reasons.doubts.push_back({"consent-scope",
                              named(consent) +
                                  " names none of research, internal, publication, product: "
                                  "whether it covers " +
                                  purpose + " is for you to judge",
                              ""});
  }
}

void ask_signature(const Consent& consent, ConsentReasons& reasons) {
  if (consent.key.empty() && consent.signature.empty()) {
    return;
  }
  const std::string problem =
      signature_problem(consent_statement(consent), consent.signature, consent.key);
  if (!problem.empty()) {
    reasons.refusals.push_back({"consent-signature", named(consent) + " " + problem,
                                "sign it as it stands now (atelier sign), or put back what was "
                                "signed, and run the stages again"});
  }
}

bool is_revoked(const Consent& consent, const std::filesystem::path& list) {
  const std::vector<std::string> ids =
      parse_revocations(read_file_text(list, Limits{}.text_file_bytes), list.string());
  return std::find(ids.begin(), ids.end(), consent_id(consent)) != ids.end();
}

void ask_revocation(const Consent& consent, const ConsentUse& use, ConsentReasons& reasons) {
  const bool is_address = consent.revocation.find("://") != std::string::npos;
  for (const std::string& one : {is_address ? std::string() : consent.revocation, use.revoked}) {
    if (one.empty()) {
      continue;
    }
    try {
      if (is_revoked(consent, one)) {
        reasons.refusals.push_back(
            {"consent-revoked",
             named(consent) + " was revoked (" + consent_id(consent) + " in " + one + ")",
             "ask for a new one, and remove what is left"});
        return;
      }
    } catch (const DataError& error) {
      reasons.refusals.push_back(
          {"consent-unchecked", named(consent) + " cannot be checked: " + error.what(), ""});
      return;
    }
  }
  if (is_address && use.revoked.empty()) {
    reasons.doubts.push_back({"consent-unchecked",
                              named(consent) + " may have been revoked at " + consent.revocation +
                                  ", which was not asked",
                              "give --revoked FILE"});
  }
}

std::vector<std::string> sentences(const std::vector<ConsentReason>& reasons) {
  std::vector<std::string> all;
  for (const ConsentReason& reason : reasons) {
    all.push_back(reason.what + (reason.advice.empty() ? "" : "; " + reason.advice));
  }
  return all;
}

}  // namespace

OptionTable describe(ConsentUse& use) {
  return OptionTable()
      .add("purpose", use.purpose, std::vector<std::string>(kPurposes.begin(), kPurposes.end()),
           "Use that is made of the person's likeness, which the consent has to cover")
      .not_keyed()
      .add("revoked", use.revoked, {},
           "File of revoked consents, besides those that consents name; empty: no other")
      .not_keyed();
}

std::string consent_id(const Consent& consent) {
  return hex(sha256(consent.who + "\n" + consent.scope + "\n" + consent.until + "\n"))
      .substr(0, kIdDigits);
}

std::vector<std::string> parse_revocations(std::string_view text, const std::string& file) {
  std::vector<std::string> ids;
  int number = 0;
  for (const std::string& text_line : split_text(text, '\n')) {
    std::string_view line = text_line;
    ++number;
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    if (line.empty() || line.starts_with('#')) {
      continue;
    }
    const std::string_view id = line.substr(0, line.find(' '));
    if (id.size() != kIdDigits ||
        id.find_first_not_of("0123456789abcdef") != std::string_view::npos) {
      throw DataError(file, "line " + std::to_string(number), "no id of a consent",
                      "16 hexadecimal digits, as atelier verify prints them");
    }
    ids.emplace_back(id);
  }
  return ids;
}

ConsentAnswer ask_consent(const std::vector<Consent>& consent, const ConsentUse& use, double now) {
  ConsentReasons reasons;
  for (const std::string& ended : ended_consent(consent, now)) {
    reasons.refusals.push_back(
        {"consent-ended", ended, "renew it where the capture states it and run the stages again"});
  }
  for (const Consent& one : consent) {
    ask_signature(one, reasons);
    ask_scope(one, use.purpose, reasons);
    ask_revocation(one, use, reasons);
  }
  return {sentences(reasons.refusals), sentences(reasons.doubts)};
}

std::vector<Finding> consent_findings(const std::vector<Consent>& consent, const ConsentUse& use,
                                      const std::string& place) {
  std::vector<Finding> findings;
  for (const Consent& one : consent) {
    ConsentReasons reasons;
    ask_scope(one, use.purpose, reasons);
    reasons.doubts.clear();  // a scope in other words is as good as one of ours
    ask_revocation(one, use, reasons);
    for (const ConsentReason& reason : reasons.refusals) {
      const bool revoked = reason.code == "consent-revoked";
      findings.push_back({revoked ? Severity::Error : Severity::Warning, reason.code, place,
                          reason.what, reason.advice});
    }
    for (const ConsentReason& reason : reasons.doubts) {
      findings.push_back({Severity::Note, reason.code, place, reason.what, reason.advice});
    }
  }
  return findings;
}

std::vector<std::string> require_consent(const std::vector<Consent>& consent,
                                         const ConsentUse& use) {
  ConsentAnswer answer = ask_consent(consent, use, static_cast<double>(std::time(nullptr)));
  if (!answer.refusals.empty()) {
    throw ConsentRefused(answer.refusals);
  }
  return answer.doubts;
}

}  // namespace atelier
