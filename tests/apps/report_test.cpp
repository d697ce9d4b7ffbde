// What `report` and `export` make of a workspace.

#include <fstream>

#include "core/exit_code.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "core/store/commit.h"
#include "core/store/input_digest.h"
#include "tests/apps/statistics_fixture.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

class Report : public StatisticsFixture {
 protected:
  void SetUp() override {
    write_boxes(input(), 2);
    ASSERT_EQ(run_child(statistics()).exit_code, 0);
  }
  void write_consent(const std::string& until) const {
    std::ofstream(input() / "capture.toml")
        << "[consent]\nwho = \"P. <b>Doe</b>\"\nscope = \"research\"\nuntil = \"" << until
        << "\"\n";
    ASSERT_EQ(run_child(statistics()).exit_code, 0);
  }
  std::string page() const {
    return read_file_text(workspace() / "report" / "index.html", 1 << 24);
  }
  ChildResult report() const { return run({"report", workspace().string()}); }
  ChildResult export_to(const fs::path& out, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"export", workspace().string(), out.string()});
    return run(more);
  }
};

TEST_F(Report, Page_ShowsStatesFiguresAndMissingConsent) {
  const ChildResult result = report();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("statistics: done, consent: none recorded"));
  EXPECT_THAT(page(), AllOf(HasSubstr("no consent is recorded"), HasSubstr("vertices_mean"),
                            HasSubstr("<td class=\"number\">8</td>")));
}

TEST_F(Report, Consent_IsShownEscaped) {
  write_consent("2999-12-31");
  const ChildResult result = report();
  EXPECT_THAT(result.out, HasSubstr("P. <b>Doe</b>, research, until 2999-12-31"));
  EXPECT_THAT(page(), AllOf(HasSubstr("P. &lt;b&gt;Doe&lt;/b&gt;, research, until 2999-12-31"),
                            Not(HasSubstr("<b>Doe")), Not(HasSubstr("no consent is recorded")),
                            HasSubstr("No warnings.")));
}

TEST_F(Report, ExpiredConsent_IsReported) {
  write_consent("2020-01-01");
  EXPECT_EQ(report().exit_code, 0);
  EXPECT_THAT(page(), HasSubstr("consent-ended"));
}

TEST_F(Report, ResultDamage_IsShownFirst) {
  const fs::path file = fs::canonical(stage_folder() / "current") / "statistics.json";
  std::ofstream(file, std::ios::app) << "x";
  EXPECT_EQ(report().exit_code, 0);
  const std::string text = page();
  EXPECT_LT(text.find("the result is damaged"), text.find("<h2"));
  EXPECT_THAT(text, AllOf(HasSubstr("output-size"), Not(HasSubstr("--force"))));
  EXPECT_GT(text.find("This result is damaged: its files are not what the stage wrote"),
            text.find("id=\"statistics\""))
      << "where its figures stand, too";
  run_child(statistics());
  report();
  EXPECT_THAT(page(), Not(HasSubstr("damaged"))) << "as the page advised";
}

TEST_F(Report, OutputPath_IsFollowedAndReportIsRepeatable) {
  EXPECT_EQ(report().exit_code, 0);
  EXPECT_EQ(report().exit_code, 0);
  const fs::path file = root_ / "page.html";
  EXPECT_EQ(run({"report", workspace().string(), "--out", file.string()}).exit_code, 0);
  EXPECT_EQ(read_file_text(file, 1 << 24), page());
  EXPECT_TRUE(is_clean());
}

TEST_F(Report, LeftoversOfAKilledReport_AreRemoved) {
  fs::create_directories(workspace() / "report");
  std::ofstream(workspace() / "report" / ".atelier-a1b2c3.tmp") << "half";
  EXPECT_EQ(report().exit_code, 0);
  EXPECT_FALSE(fs::exists(workspace() / "report" / ".atelier-a1b2c3.tmp"));
  EXPECT_TRUE(is_clean());
}

TEST_F(Report, NonWorkspaceOrMissingPlace_IsRefused) {
  EXPECT_EQ(run({"report"}).exit_code, 2);
  const ChildResult nothing = run({"report", (root_ / "nothing").string()});
  EXPECT_EQ(nothing.exit_code, 3);
  EXPECT_THAT(nothing.err, HasSubstr("expected a workspace"));
  EXPECT_EQ(run({"report", input().string()}).exit_code, 3);
  const ChildResult place =
      run({"report", workspace().string(), "--out", (root_ / "no" / "page.html").string()});
  EXPECT_EQ(place.exit_code, 5);
  EXPECT_THAT(place.err, HasSubstr("no such folder"));
}

TEST_F(Report, ExportedResult_CarriesConsent) {
  write_consent("2999-12-31");
  const fs::path out = root_ / "out";
  const ChildResult result = export_to(out);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("consent: P. <b>Doe</b>, research"));
  EXPECT_THAT(read_file_text(out / "statistics" / "consent.txt", 1000), HasSubstr("research"));
  EXPECT_EQ(read_file_text(out / "statistics" / "statistics.json", 1 << 20),
            read_file_text(stage_folder() / "current" / "statistics.json", 1 << 20));
}

TEST_F(Report, ExportAfterTheEndOfConsent_IsRefusedUnlessAllowed) {
  write_consent("2020-01-01");
  const fs::path out = root_ / "out";
  const ChildResult refused = export_to(out);
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err,
              AllOf(HasSubstr("the consent of P. <b>Doe</b> (research) ended with 2020-01-01"),
                    HasSubstr("--ended-consent")));
  EXPECT_FALSE(fs::exists(out));
  const ChildResult allowed = export_to(out, {"--ended-consent"});
  EXPECT_EQ(allowed.exit_code, 0) << allowed.err;
  EXPECT_THAT(read_file_text(out / "statistics" / "consent.txt", 1000), HasSubstr("ended with"));
}

TEST_F(Report, ExportAfterConsentWasCutShort_IsRefused) {
  write_consent("2999-12-31");
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = \"P. Doe\"\nscope = \"research\"\nuntil = \"2020-01-01\"\n";
  EXPECT_EQ(export_to(root_ / "out").exit_code, kExitCheckFailed);
}

TEST_F(Report, ExportWithoutConsent_IsReported) {
  EXPECT_THAT(export_to(root_ / "out").out, HasSubstr("consent: none recorded"));
}

TEST_F(Report, ExportOfDamageOrToBadPlaces_IsRefused) {
  EXPECT_EQ(run({"export", workspace().string()}).exit_code, 2);
  EXPECT_THAT(export_to(root_ / "out", {"--format", "fbx"}).err, HasSubstr("ply, obj, glb, usda"));
  EXPECT_THAT(export_to(root_ / "out", {"--stage", "spline"}).err, HasSubstr("'spline'"));
  EXPECT_EQ(export_to("/proc/nowhere").exit_code, 5);
  // One byte is another: sizes do not show it, so that what export names has to compare bytes.
  std::fstream(fs::canonical(stage_folder() / "current") / "statistics.json").put('x');
  const ChildResult damaged = export_to(root_ / "out");
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.err, AllOf(HasSubstr("a result that is damaged"),
                                 HasSubstr("atelier status --digests says what")));
  EXPECT_EQ(run({"status", workspace().string(), "--digests", "--check"}).exit_code,
            kExitCheckFailed);
  EXPECT_FALSE(fs::exists(root_ / "out" / "statistics"));
}

TEST_F(Report, FailedExport_LeavesItsPlaceFree) {
  const fs::path out = root_ / "new" / "out";
  // Files may hold nothing: the first that is written fails.
  const ChildResult full = run_child({"bash", "-c",
                                      "ulimit -f 0; exec '" + program_path() + "' export '" +
                                          workspace().string() + "' '" + out.string() + "'"});
  EXPECT_EQ(full.exit_code, 5) << full.err;
  EXPECT_FALSE(fs::exists(root_ / "new"));
  EXPECT_EQ(export_to(out).exit_code, 0);
  const ChildResult again = export_to(out);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("already exists, and no flag replaces it; choose another OUT"));
  EXPECT_TRUE(fs::exists(out / "statistics" / "consent.txt")) << "it was another's";
}

TEST_F(Report, ExportThroughMissingParentFolder_CreatesNone) {
  const fs::path out = root_ / "out";
  const ChildResult result = export_to(out / "new" / "..");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::exists(out / "statistics" / "consent.txt"));
  EXPECT_FALSE(fs::exists(out / "new"));
  for (const fs::path& place : {workspace(), input()}) {
    const ChildResult refused = export_to(place / "new" / "..");
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("OUT lies in "));
    EXPECT_FALSE(fs::exists(place / "new"));
  }
}

TEST_F(Report, PageAmongResults_IsNotWritten) {
  const fs::path result = fs::canonical(stage_folder() / "current");
  for (const fs::path& file : {result / "page.html", stage_folder() / "page.html"}) {
    const ChildResult refused = run({"report", workspace().string(), "--out", file.string()});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("among the results of 'statistics'"));
  }
  EXPECT_TRUE(is_clean());
  EXPECT_EQ(run({"report", workspace().string(), "--out", (workspace() / "page.html").string()})
                .exit_code,
            0);
}

TEST_F(Report, PageOrExportIntoAnInput_IsNotWritten) {
  const ChildResult page =
      run({"report", workspace().string(), "--out", (input() / "page.html").string()});
  EXPECT_EQ(page.exit_code, 2);
  EXPECT_THAT(page.err, AllOf(HasSubstr("--out lies in "), HasSubstr("of which 'statistics'")));
  const ChildResult exported = export_to(input() / "out");
  EXPECT_EQ(exported.exit_code, 2);
  EXPECT_THAT(exported.err, AllOf(HasSubstr("OUT lies in "), HasSubstr("of which 'statistics'")));
  EXPECT_FALSE(fs::exists(input() / "page.html"));
  EXPECT_FALSE(fs::exists(input() / "out"));
  EXPECT_THAT(run_child(statistics()).out, HasSubstr("is done already"));
}

TEST_F(Report, ExportIntoACapture_IsNotWritten) {
  const fs::path other = root_ / "other";
  fs::create_directories(other);
  std::ofstream(other / "capture.toml") << "fps = 30\n";
  const ChildResult refused = export_to(other / "out");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("OUT lies in the capture "));
  EXPECT_FALSE(fs::exists(other / "out"));
}

TEST_F(Report, PageIntoAMovedCapture_IsNotWritten) {
  write_consent("2999-12-31");
  const fs::path moved = root_ / "moved";
  fs::rename(input(), moved);
  const ChildResult refused =
      run({"report", workspace().string(), "--out", (moved / "page.html").string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--out lies in the capture "));
  fs::rename(moved, input());
  const ChildResult here =
      run_child({"bash", "-c",
                 "cd '" + input().string() + "'; exec '" + program_path() + "' report '" +
                     workspace().string() + "' --out page.html"});
  EXPECT_EQ(here.exit_code, 2);
  EXPECT_FALSE(fs::exists(input() / "page.html"));
}

TEST_F(Report, DamagedRunAccount_IsReportedAndTheRestShown) {
  EXPECT_EQ(report().exit_code, 0);
  for (const char* text : {"", "{", "[]", "{\"schema\": \"<b>\", \"version\": 1}"}) {
    std::ofstream(workspace() / "report" / "run.json") << text;
    EXPECT_EQ(report().exit_code, 0) << text;
    EXPECT_THAT(page(), AllOf(HasSubstr("what the last run came to cannot be read: "),
                              HasSubstr("vertices_mean"), Not(HasSubstr("\"<b>\""))));
  }
}

TEST_F(Report, ImageCount_IsConfigurable) {
  EXPECT_EQ(run({"report", workspace().string(), "--pictures", "0"}).exit_code, 0);
  EXPECT_EQ(run({"report", workspace().string(), "--pictures", "-1"}).exit_code, 2);
}

/// A result of `statistics` that holds other files: a sequence at its root with a note beside it,
/// and two meshes by themselves.
void make_result_of_meshes(const fs::path& stage_folder) {
  Mesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  const fs::path staging = stage_folder / ".staging-0";
  fs::create_directories(staging / "scans");
  write_sequence(staging, sequence_of({mesh, mesh}, 30, {4, 7}));
  std::ofstream(staging / "frames" / "note.txt") << "by hand";
  write_mesh_archive(staging / "scans" / "000001.h5", mesh);
  write_mesh_archive(staging / "scans" / "000002.h5", mesh);
  Manifest manifest;
  manifest.stage = "statistics";
  manifest.stage_version = 1;
  manifest.canonical_options = "{}";
  manifest.key = stage_key("statistics", 1, "", "{}", {});
  manifest.started = manifest.finished = "2026-01-01T00:00:00Z";
  for (const char* path : {"frames/000004.h5", "frames/000007.h5", "frames/note.txt",
                           "scans/000001.h5", "scans/000002.h5", "sequence.h5"}) {
    const FileDigest digest = digest_of_file(staging / path);
    manifest.outputs.push_back({path, digest.size, digest.digest});
  }
  commit_result(staging, stage_folder / folder_name(manifest.key), manifest);
}

TEST_F(Report, MeshArchivesAndSequences_AreExported) {
  make_result_of_meshes(stage_folder());
  for (const std::string format : {"ply", "obj"}) {
    const fs::path out = root_ / format / "statistics";
    const ChildResult result = export_to(root_ / format, {"--format", format});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(read_mesh(out / "sequence" / ("000004." + format)).faces.rows(), 1);
    EXPECT_EQ(read_mesh(out / "sequence" / ("000007." + format)).faces.rows(), 1);
    EXPECT_EQ(read_mesh(out / "scans" / ("000002." + format)).faces.rows(), 1);
    EXPECT_EQ(read_file_text(out / "frames" / "note.txt", 100), "by hand");
    EXPECT_FALSE(fs::exists(out / "sequence.h5"));
    EXPECT_FALSE(fs::exists(out / "frames" / "000004.h5"));
  }
  ASSERT_EQ(export_to(root_ / "usd", {"--format", "usda"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(root_ / "usd" / "statistics" / "sequence.usda"));
  EXPECT_TRUE(fs::exists(root_ / "usd" / "statistics" / "scans" / "000001.ply"));
}

TEST_F(Report, ExportOptions_ComeFromAFile) {
  const std::string file = (root_ / "export.toml").string();
  std::ofstream(file) << "stage = 'reconstruct'\n";
  EXPECT_EQ(export_to(root_ / "out", {"--config", file}).exit_code, 3);  // it has no result
  EXPECT_EQ(export_to(root_ / "out", {"--config", file, "--stage", "all"}).exit_code, 0);
}

TEST_F(Report, SimulatedSequence_IsExportedInEveryFormat) {
  if (run({"simulate", "--help"}).exit_code != 0) {
    GTEST_SKIP() << "built without simulation";
  }
  const fs::path scene = root_ / "scene";
  fs::create_directories(scene);
  std::ofstream(scene / "garment.obj") << "v -.3 2 -.3\nv .3 2 -.3\nv .3 2 .3\nv -.3 2 .3\n"
                                          "f 1 3 2\nf 1 4 3\n";
  fs::copy_file(input() / "box_000.obj", scene / "body.obj");
  ASSERT_EQ(
      run({"simulate", scene.string(), workspace().string(), "--length", "2", "--settle", "0"})
          .exit_code,
      0);
  for (const char* format : {"ply", "obj"}) {
    const fs::path out = root_ / format;
    const ChildResult result = export_to(out, {"--stage", "simulate", "--format", format});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const Mesh mesh = read_mesh(out / "simulate" / "garment" / (std::string("000002.") + format));
    EXPECT_EQ(mesh.vertices.rows(), 4);
    EXPECT_LT(mesh.vertices.col(1).maxCoeff(), 2);
  }
  for (const char* format : {"glb", "usda"}) {
    const fs::path out = root_ / format;
    const ChildResult result = export_to(out, {"--stage", "simulate", "--format", format});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(fs::exists(out / "simulate" / (std::string("garment.") + format)));
  }
}
}  // namespace
}  // namespace atelier::fixtures
