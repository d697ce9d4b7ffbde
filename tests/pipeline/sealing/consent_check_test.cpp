// What consents say to a use: day, signature, scope, revocation.
#include "pipeline/sealing/consent_check.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/seal/minisign.h"
#include "core/store/consent_file.h"
#include "core/store/consent_refused.h"
#include "core/store/utc_time.h"
#include "pipeline/sealing/sealing_note.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const double kNow = *seconds_of_utc("2026-11-29T12:00:00Z");

Consent consent(const std::string& scope, const std::string& until = "") {
  Consent one;
  one.who = "P. Doe";
  one.scope = scope;
  one.until = until;
  return one;
}

ConsentAnswer ask(const Consent& one, const std::string& purpose = "research",
                  const std::string& revoked = "") {
  return ask_consent({one}, {purpose, revoked}, kNow);
}

void sign(Consent& one, const SigningKey& key) {
  one.key = signature_key_text(key.key);
  one.signature = signature_line(sign_text(consent_statement(one), key, "a consent"), "");
}

TEST(ConsentCheck, Scope_IsReadByItsWords) {
  for (const char* covered :
       {"research", "Research and publication", "internal, research", "any use", "research-only"}) {
    EXPECT_THAT(ask(consent(covered)).refusals, IsEmpty()) << covered;
    EXPECT_THAT(ask(consent(covered)).doubts, IsEmpty()) << covered;
  }
  for (const char* other : {"internal", "product", "publication; product"}) {
    EXPECT_THAT(ask(consent(other)).refusals,
                ElementsAre(AllOf(HasSubstr("does not cover research"), HasSubstr("renew"))))
        << other;
  }
  EXPECT_THAT(ask(consent("our paper")).doubts, ElementsAre(HasSubstr("for you to judge")));
  EXPECT_THAT(ask(consent("researchers")).doubts, ElementsAre(HasSubstr("for you to judge")))
      << "a word is a whole word";
}

TEST(ConsentCheck, LastDay_Counts) {
  EXPECT_THAT(ask(consent("research", "2026-11-29")).refusals, IsEmpty());
  EXPECT_THAT(ask(consent("research", "2026-11-28")).refusals,
              ElementsAre(AllOf(HasSubstr("ended with 2026-11-28"), HasSubstr("renew"))));
}

TEST(ConsentCheck, EveryPerson_IsAsked) {
  EXPECT_EQ(ask_consent({consent("internal"), consent("product")}, {}, kNow).refusals.size(), 2U);
  EXPECT_THAT(ask_consent({}, {}, kNow).refusals, IsEmpty());
  EXPECT_THROW(require_consent({consent("product")}, {}), ConsentRefused);
}

TEST(ConsentCheck, RevokedConsent_IsRefused) {
  const TemporaryDirectory folder;
  const std::string list = (folder / "revoked.txt").string();
  std::ofstream(list) << "# withdrawn\n" << consent_id(consent("research")) << " P. Doe\n";
  EXPECT_THAT(ask(consent("research"), "research", list).refusals,
              ElementsAre(HasSubstr("was revoked")));
  EXPECT_THAT(ask(consent("any research"), "research", list).refusals, IsEmpty()) << "another one";
  Consent named = consent("research");
  named.revocation = list;
  EXPECT_THAT(ask(named).refusals, ElementsAre(HasSubstr("was revoked")));
  named.revocation = (folder / "gone.txt").string();
  EXPECT_THAT(ask(named).refusals, ElementsAre(HasSubstr("cannot be checked")));
  named.revocation = "https://example.org/revoked.txt";
  EXPECT_THAT(ask(named).doubts, ElementsAre(HasSubstr("--revoked FILE")));
  std::ofstream(list) << "nonsense\n";
  EXPECT_THAT(ask(consent("research"), "research", list).refusals,
              ElementsAre(HasSubstr("cannot be checked")));
}

TEST(ConsentCheck, Findings_NameWhatIsOutOfScopeRevokedOrUnchecked) {
  const TemporaryDirectory folder;
  const std::string list = (folder / "revoked.txt").string();
  std::ofstream(list) << consent_id(consent("research")) << " P. Doe\n";
  const auto found = [](const Consent& one, const ConsentUse& use) {
    std::vector<std::string> texts;
    for (const Finding& finding : consent_findings({one}, use, "capture")) {
      texts.push_back(to_string(finding));
    }
    return texts;
  };
  EXPECT_THAT(found(consent("research"), {}), IsEmpty());
  EXPECT_THAT(found(consent("our paper"), {}), IsEmpty()) << "nobody can judge it";
  EXPECT_THAT(found(consent("research"), {"product", ""}),
              ElementsAre(AllOf(HasSubstr("warning consent-scope [capture]"),
                                HasSubstr("does not cover product"), HasSubstr("renew"))));
  EXPECT_THAT(found(consent("research"), {"research", list}),
              ElementsAre(AllOf(HasSubstr("error consent-revoked"), HasSubstr(list),
                                HasSubstr("ask for a new one"))));
  Consent named = consent("research");
  named.revocation = (folder / "gone.txt").string();
  EXPECT_THAT(found(named, {}), ElementsAre(HasSubstr("warning consent-unchecked")));
  named.revocation = "https://example.org/revoked.txt";
  EXPECT_THAT(found(named, {}), ElementsAre(HasSubstr("note consent-unchecked")));
}

TEST(ConsentCheck, SignedConsent_IsRefusedOnceItIsChanged) {
  const SigningKey key = new_signing_key();
  Consent one = consent("research", "2026-12-31");
  one.revocation = "https://example.org/revoked.txt";
  sign(one, key);
  EXPECT_THAT(ask(one).refusals, IsEmpty());
  for (std::string Consent::*field :
       {&Consent::who, &Consent::scope, &Consent::until, &Consent::revocation}) {
    Consent changed = one;
    changed.*field = field == &Consent::until ? "2036-12-31" : "any research";
    EXPECT_THAT(ask(changed, "research").refusals,
                ::testing::Contains(HasSubstr("is signed wrongly")));
  }
  Consent other = one;
  other.key = signature_key_text(new_signing_key().key);
  EXPECT_THAT(ask(other).refusals, ElementsAre(HasSubstr("signed wrongly")));
  other = one;
  other.signature = "";
  EXPECT_THAT(ask(other).refusals, ElementsAre(HasSubstr("has no signature")));
  other = one;
  other.key = "";
  EXPECT_THAT(ask(other).refusals, ElementsAre(HasSubstr("names no key")));
}

TEST(ConsentCheck, SignedConsent_ComesBackFromFiles) {
  Consent one = consent("research", "2026-12-31");
  one.revocation = "revoked.txt";
  sign(one, new_signing_key());
  EXPECT_EQ(parse_consent(consent_toml({one}), "consent.toml"), std::vector{one});
  SealingNote note{"workspace", "2026-11-29T10:40:00Z", "research", "", {one}};
  EXPECT_EQ(parse_sealing_note(sealing_note_text(note), "").consent, std::vector{one});
  EXPECT_THAT(to_string({one}), HasSubstr("signed by " + one.key));
}

TEST(ConsentCheck, SignatureOfMinisign_IsAccepted) {
  ATELIER_NEEDS_PROGRAM("minisign");
  const TemporaryDirectory folder;
  const auto place = [&](const std::string& name) { return (folder / name).string(); };
  const auto read = [&](const std::string& name) {
    std::ifstream file(folder / name, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  Consent one = consent("research");
  std::ofstream(folder / "statement") << consent_statement(one);
  ASSERT_EQ(
      run_child({"minisign", "-G", "-W", "-p", place("k.pub"), "-s", place("k.key")}).exit_code, 0);
  ASSERT_EQ(
      run_child({"minisign", "-S", "-s", place("k.key"), "-m", place("statement"), "-t", "yes"})
          .exit_code,
      0);
  one.key = signature_key_text(parse_signature_key(read("k.pub"), "k.pub"));
  one.signature = signature_line(read("statement.minisig"), "statement.minisig");
  EXPECT_THAT(ask(one).refusals, IsEmpty());
}

TEST(ConsentCheck, OwnSignature_IsAcceptedByMinisign) {
  ATELIER_NEEDS_PROGRAM("minisign");
  const TemporaryDirectory folder;
  Consent one = consent("research");
  sign(one, new_signing_key());
  std::ofstream(folder / "statement") << consent_statement(one);
  std::ofstream(folder / "statement.minisig") << signature_of_line(one.signature);
  EXPECT_EQ(
      run_child({"minisign", "-V", "-P", one.key, "-m", (folder / "statement").string()}).exit_code,
      0);
}

}  // namespace
}  // namespace atelier::fixtures
