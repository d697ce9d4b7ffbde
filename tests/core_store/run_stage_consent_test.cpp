// Consent travels with the results of stages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_status.h"
#include "tests/core_store/run_stage_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using End = StageReport::End;

TEST_F(RunStage, ResultUsedAsInput_BringsItsConsent) {
  const std::string stated = "[[consent]]\nwho = \"Ada\"\nscope = \"tests\"\nuntil = \"\"\n";
  write(root_ / "in/consent.toml", stated);
  run("count");
  StageRequest what = request("count");
  what.input = current("count");
  what.workspace = root_ / "second";
  const StageReport second = run("count", what);
  ASSERT_EQ(second.manifest.consent.size(), 1u);
  EXPECT_EQ(second.manifest.consent[0].who, "Ada");
  const auto changed = [&] {
    std::string codes;
    const std::filesystem::path folder = root_ / "second/count";
    const std::filesystem::path result = folder / current_name(folder).value_or("none");
    for (const Finding& finding :
         check_outputs(result, read_manifest(result, "count"), Check::Sizes)) {
      codes += finding.code + " ";
    }
    return codes;
  };
  EXPECT_EQ(changed(), "");
  write(root_ / "in/consent.toml",
        "[[consent]]\nwho = \"Ada\"\nscope = \"nothing\"\nuntil = \"\"\n");
  EXPECT_EQ(changed(), "consent-changed ");
}

TEST_F(RunStage, Consent_IsPassedDownTheChain) {
  write(root_ / "in/capture.toml",
        "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2030-12-31\n");
  run("count");
  run("double");
  const std::vector<Consent> expected = {{"P. Doe", "research", "2030-12-31"}};
  EXPECT_EQ(read_manifest(current("count"), "count").consent, expected);
  EXPECT_EQ(read_manifest(current("double"), "double").consent, expected);
}

TEST_F(RunStage, EmptyConsent_IsRefused) {
  for (const char* text : {"[consent]\n", "[[consent]]\n", "[consent]\nwho = 'P'\n",
                           "[consent]\nwho = ''\nscope = 'research'\n"}) {
    write(root_ / "consent.toml", text);
    try {
      run("count");
      ADD_FAILURE() << text;
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), HasSubstr("no who or no scope")) << text;
    }
  }
}

TEST_F(RunStage, FinishedResult_LearnsNewConsent) {
  write(root_ / "capture.toml", "[consent]\nwho = 'P. Doe'\nscope = 'research'\n");
  run("count");
  run("double");
  write(root_ / "capture.toml", "[consent]\nwho = 'P. Doe'\nscope = 'nothing'\n");
  const StageReport again = run("count");
  EXPECT_EQ(again.end, End::AlreadyDone);
  const std::vector<Consent> expected = {{"P. Doe", "nothing", ""}};
  EXPECT_EQ(again.manifest.consent, expected);
  EXPECT_EQ(read_manifest(current("count"), "count").consent, expected);
  EXPECT_EQ(run("double").end, End::AlreadyDone);
  EXPECT_EQ(read_manifest(current("double"), "double").consent, expected);
  EXPECT_THAT(check_outputs(current("count"), again.manifest, Check::Digests), IsEmpty());
}

TEST_F(RunStage, ExpiredConsent_NamesItsFile) {
  write(root_ / "in/consent.toml", "[consent]\nwho = 'A'\nscope = 'b'\nuntil = 2001-12-31\n");
  const StageReport report = run("count");
  const auto findings = check_outputs(current("count"), report.manifest, Check::Sizes);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(findings[0].advice, HasSubstr((root_ / "in/consent.toml").string()));
  write(root_ / "in/consent.toml", "[consent");
  const auto unreadable = check_outputs(current("count"), report.manifest, Check::Sizes);
  ASSERT_EQ(unreadable.size(), 2u);
  EXPECT_THAT(unreadable[0].advice, HasSubstr("the capture.toml or consent.toml of the capture"));
  EXPECT_EQ(unreadable[1].code, "consent-changed");
  EXPECT_THAT(unreadable[1].what, HasSubstr("cannot be read"));
  EXPECT_THAT(unreadable[1].advice, HasSubstr("mend the file"));  // a run refuses it
}

TEST_F(RunStage, ChangedConsent_IsReportedForAllDerivedResults) {
  write(root_ / "consent.toml", "[consent]\nwho = 'P'\nscope = 'research'\n");
  run("count");
  run("double");
  const auto warnings = [&] {
    std::vector<std::string> found;
    for (const StageStatus& status : workspace_status(kTestStages, root_ / "work")) {
      for (const Finding& finding : status.findings) {
        if (finding.code == "consent-changed") {
          EXPECT_EQ(finding.severity, Severity::Warning);
          EXPECT_EQ(status.state, StageStatus::State::Done);
          found.push_back(status.stage + ": " + finding.what);
        }
      }
    }
    return found;
  };
  EXPECT_THAT(warnings(), IsEmpty());
  write(root_ / "consent.toml", "[consent]\nwho = 'P'\nscope = 'withdrawn'\nuntil = 2026-01-01\n");
  const std::string today = "it was 'P, research', today it says 'P, withdrawn, until 2026-01-01'";
  EXPECT_THAT(warnings(), ElementsAre(HasSubstr(today), HasSubstr("double: ")));
  std::filesystem::remove(root_ / "consent.toml");
  EXPECT_THAT(warnings()[1], HasSubstr("today it says 'none recorded'"));
  write(root_ / "consent.toml", "[consent");
  EXPECT_THAT(warnings()[0], HasSubstr("what the consent says today cannot be read: "));
  std::filesystem::remove_all(root_ / "in");
  EXPECT_THAT(warnings(), IsEmpty()) << "of an input that is gone nothing is known";
}

TEST_F(RunStage, RenewedConsentInInput_RedoesNothing) {
  write(root_ / "in/capture.toml", "fps = 30\n\n[[consent]]\nwho = 'P'\nscope = 'a'\n");
  write(root_ / "in/consent.toml", "[consent]\nwho = 'P'\nscope = 'unheard'\n");
  run("count");
  write(root_ / "in/capture.toml",
        "fps = 30\n\n[[consent]]\nwho = 'P'\nscope = 'b'\n\n[[consent]]\nwho = 'Q'\nscope = 'c'\n");
  const StageReport again = run("count");
  EXPECT_EQ(again.end, End::AlreadyDone);
  EXPECT_EQ(to_string(read_manifest(current("count"), "count").consent), "P, b; Q, c");
  write(root_ / "in/capture.toml", "fps = 30\n");
  write(root_ / "in/consent.toml", "[consent]\nwho = 'P'\nscope = 'd'\n");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(to_string(read_manifest(current("count"), "count").consent), "P, d");
  write(root_ / "in/capture.toml", "fps = 60\n");
  EXPECT_EQ(run("count").end, End::Done);
}

}  // namespace
}  // namespace atelier::fixtures
