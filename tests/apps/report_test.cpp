// What `report` and `export` make of a workspace.

#include <cmath>
#include <fstream>

#include "core/exit_code.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "core/store/commit.h"
#include "core/store/input_digest.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"
#include "tests/apps/browser.h"
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

/// A workspace status whose one result holds the files of `folder`'s `statistics`.
StageStatus result_of(std::vector<ManifestOutput> outputs) {
  StageStatus status;
  status.stage = "statistics";
  status.state = StageStatus::State::Done;
  status.manifest.emplace();
  status.manifest->stage = "statistics";
  status.manifest->outputs = std::move(outputs);
  return status;
}

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

TEST(ReportPage, Images_AreEmbeddedAndLargeOnesNamed) {
  const TemporaryDirectory root;
  StageStatus status =
      result_of({{"sheet.png", 0, {}}, {"film.mp4", 3, {}}, {"big.png", 5'000'000, {}}});
  const fs::path folder = root.path() / "statistics" / folder_name(status.manifest->key);
  fs::create_directories(folder);
  Image image(2, 1, 3);
  image.at(0, 0, 0) = 1;
  write_image(folder / "sheet.png", image);
  std::ofstream(folder / "film.mp4") << "abc";
  const std::string page = report_page(std::span(&status, 1), root.path());
  EXPECT_THAT(page, HasSubstr("<img alt=\"sheet.png\" src=\"data:image/png;base64,iVBORw0KGgo"));
  EXPECT_THAT(page, HasSubstr("src=\"data:video/mp4;base64,YWJj\""));
  EXPECT_THAT(page, AllOf(HasSubstr("big.png"), Not(HasSubstr("alt=\"big.png\""))));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
}

TEST(ReportPage, ContactSheets_ComeBeforeEvenlySampledFrames) {
  const TemporaryDirectory root;
  std::vector<ManifestOutput> outputs;
  for (int i = 0; i < 9; ++i) {
    outputs.push_back({"pictures/" + std::to_string(i) + ".png", 3, {}});
  }
  outputs.push_back({"strip.png", 3, {}});
  StageStatus status = result_of(outputs);
  const fs::path folder = root.path() / "statistics" / folder_name(status.manifest->key);
  fs::create_directories(folder / "pictures");
  for (const ManifestOutput& output : outputs) {
    std::ofstream(folder / output.path) << "abc";
  }
  ReportOptions options;
  const auto shown = [&](int most) {
    options.pictures = most;
    const std::string page = report_page(std::span(&status, 1), root.path(), options);
    std::string names;
    constexpr std::string_view kName = "<img alt=\"";
    for (std::size_t at = page.find(kName); at != std::string::npos; at = page.find(kName, at)) {
      at += kName.size();
      names += page.substr(at, page.find('"', at) - at) + " ";
    }
    const std::size_t more = page.find(" more in statistics/current/pictures</p>");
    return names + (more == std::string::npos ? "" : page.substr(more - 1, 1) + " more");
  };
  EXPECT_EQ(shown(4), "strip.png pictures/0.png pictures/4.png pictures/8.png 6 more");
  EXPECT_EQ(shown(1), "strip.png 9 more");
  EXPECT_EQ(shown(0), "9 more");
  EXPECT_THAT(shown(10), AllOf(HasSubstr("pictures/7.png"), Not(HasSubstr("more"))));
}

TEST(ReportPage, Warnings_ComeFirstAndManyAreFolded) {
  StageStatus status = result_of({{"a.txt", 1, {}}});
  for (int i = 0; i < 7; ++i) {
    status.manifest->warnings.push_back("doubt " + std::to_string(i));
  }
  const std::string page = report_page(std::span(&status, 1), "w");
  const std::size_t section = page.find("<h2 id=\"statistics\">");
  ASSERT_NE(section, std::string::npos);
  const std::string head = page.substr(0, section);
  EXPECT_THAT(head, AllOf(HasSubstr("doubt 0"), HasSubstr("doubt 4"), Not(HasSubstr("doubt 5")),
                          HasSubstr("2 more warnings, below"), Not(HasSubstr("No warnings."))));
  EXPECT_THAT(page.substr(section), AllOf(HasSubstr("<summary>7 warnings</summary>"),
                                          HasSubstr("doubt 0"), HasSubstr("doubt 6")));
}

TEST(ReportPage, TextFromFiles_IsNotMarkup) {
  EXPECT_EQ(html_text("<a href='x' title=\"y\">&\x1b[2J</a>"),
            "&lt;a href=&#39;x&#39; title=&quot;y&quot;&gt;&amp;?[2J&lt;/a&gt;");
  StageStatus status = result_of({{"a.txt", 1, {}}});
  status.manifest->inputs.emplace_back().path = "<script>alert(1)</script>";
  status.manifest->options.push_back({"x", "\"</table>\"", "<file>:1", true});
  status.reasons = {"<img src=x onerror=alert(1)>"};
  status.manifest->warnings = {"<script>alert(2)</script>"};
  const std::string page = report_page(std::span(&status, 1), "w<i>");
  EXPECT_THAT(page, AllOf(Not(HasSubstr("<script")), Not(HasSubstr("<img src=x")),
                          Not(HasSubstr("\"</table>")), Not(HasSubstr("w<i>"))));
}

TEST_F(Report, Page_LoadsInABrowserWithEveryImage) {
  if (!has_browser()) {
    GTEST_SKIP() << "no program chromium (scripts/setup)";
  }
  StageStatus status = result_of({{"sheet.png", 0, {}}, {"torn.png", 9, {}}});
  const fs::path folder = root_ / "statistics" / folder_name(status.manifest->key);
  fs::create_directories(folder);
  write_image(folder / "sheet.png", Image(2, 1, 3, 0.5F));
  std::ofstream(folder / "torn.png") << "no PNG";
  const fs::path page = root_ / "page.html";
  const RunAccount account{"a capture", "2026-01-01T00:00:00Z", 3, {{"track", "done", "", 1, 2}}};
  std::ofstream(page) << report_page(
      std::span(&status, 1), root_.path(), {},
      {.run = account,
       .drawn = {{"statistics", plots_svg({{"strain", {0, 1, 2}, {0.1, 0.3, 0.2}}})}}});
  const BrowsedPage found = browse(page, root_.path());
  EXPECT_EQ(found.images, 2);
  EXPECT_EQ(found.broken, 1) << "torn.png";
  EXPECT_THAT(found.text, AllOf(HasSubstr("The run"), HasSubstr("strain")));
  EXPECT_THAT(found.messages, Not(HasSubstr("CONSOLE")));  // what a page's errors are logged as
}

TEST(ReportPlots, FrameSeries_IsPlottedWithItsRange) {
  const std::string svg = plots_svg({{"gap <mm>", {3, 4, 9}, {0.5, 2, 1}}, {"empty", {}, {}}});
  EXPECT_THAT(svg, AllOf(HasSubstr("gap &lt;mm&gt;"), HasSubstr(">2</text>"),
                         HasSubstr(">9</text>"), HasSubstr("frame 4: 2"), Not(HasSubstr("empty"))));
  EXPECT_EQ(plots_svg({}), "");
  EXPECT_EQ(plots_svg({{"uneven", {1, 2}, {1}}}), "");
  EXPECT_EQ(plots_svg({{"not finite", {1}, {std::nan("")}}}), "");
}

TEST(ReportPage, FailedAndSkippedStages_ComeFirst) {
  const RunAccount account{"<c>",
                           "",
                           1,
                           {{"track", "failed", "a <b>reason</b>", 1, 2},
                            {"body", "skipped", "it reads track", 0, 0},
                            {"validate", "done", "", 0, 0}}};
  const std::string page = report_page({}, "w", {}, {.run = account, .subject = "<i>somebody</i>"});
  EXPECT_THAT(page, HasSubstr("<h1>Atelier: w, &lt;i&gt;somebody"));
  EXPECT_LT(page.find("a &lt;b&gt;reason"), page.find("The run"));
  EXPECT_THAT(page, AllOf(HasSubstr("<b>body</b> was skipped"), Not(HasSubstr("<b>validate</b>")),
                          Not(HasSubstr("<c>"))));
}

TEST(ReportPage, Errors_ComeBeforeWarningsAndRepeatsAreMerged) {
  StageStatus first = result_of({{"a.txt", 1, {}}});
  first.manifest->warnings = {"warning consent-none [capture]: no consent is recorded",
                              "a doubt of both", "error distortion-scaled [file]: a 64th"};
  StageStatus second = first;
  second.stage = second.manifest->stage = "reconstruct";
  const std::vector<StageStatus> stages = {first, second};
  const std::string reason = "no frame has images with masks";
  const RunAccount account{"c",
                           "",
                           1,
                           {{"body", "skipped", reason, 0, 0},
                            {"template", "skipped", reason, 0, 0},
                            {"animate", "failed", "no such motion", 0, 0}}};
  const std::string page = report_page(stages, "w", {}, {.run = account});
  const std::string head = page.substr(0, page.find("<h2"));
  EXPECT_THAT(head,
              AllOf(HasSubstr("<b>statistics, reconstruct</b>: no consent is recorded: state"),
                    HasSubstr("<b>statistics, reconstruct</b>: a doubt of both"),
                    HasSubstr("<li class=\"error\"><b>statistics, reconstruct</b>: error "
                              "distortion-scaled"),
                    HasSubstr("<b>body, template</b> were skipped: " + reason),
                    Not(HasSubstr("consent-none"))));
  EXPECT_LT(head.find("no such motion"), head.find("distortion-scaled"));
  EXPECT_LT(head.find("distortion-scaled"), head.find("were skipped"));
  const std::string run = page.substr(page.find("<h2 id=\"run\""));
  EXPECT_EQ(run.find(reason), run.rfind(reason)) << "the second is said to be as the first";
  EXPECT_THAT(run, HasSubstr("as body"));
}

TEST(ReportPage, TargetTable_ShowsMissesAndMissingMeasurements) {
  ReportFigure missed{"track.mean_mm", "8 mm", "missed", false, "over 12 frames"};
  missed.range = "at most 6";
  missed.missed_by = "2 mm";
  missed.accuracy = "at most 5, missed by 3 mm";
  ReportFigure absent{"body.mean_mm", "-", "not measured", true, "there is no <result> of body"};
  absent.range = "at most 5";
  const ReportFigures figures{
      "By some ranges.", {missed, absent}, {{"track.extra", "7", "", true, "beside it"}}};
  const std::string page = report_page({}, "w", {}, {.figures = figures});
  EXPECT_THAT(
      page,
      AllOf(HasSubstr("<b>track.mean_mm</b>: 8 mm, missed by 2 mm (at most 6)"),
            HasSubstr("0 met, 1 missed, 0 not judged, 1 not measured. By some ranges."),
            HasSubstr("<td class=\"state error\">missed</td>"),
            HasSubstr("at most 5, missed by 3 mm"), HasSubstr("there is no &lt;result&gt; of body"),
            HasSubstr("<summary>1 other figure</summary>"), HasSubstr("beside it")));
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
