// The page of a report: what it shows of results, in which order, and that text of files is no
// markup.

#include "pipeline/pictures/report_page.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/image_file.h"
#include "core/store/commit.h"
#include "pipeline/pictures/report_plots.h"
#include "pipeline/pictures/report_summary.h"
#include "tests/support/browser.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

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

TEST(ReportPage, Page_LoadsInABrowserWithEveryImage) {
  if (!has_browser()) {
    GTEST_SKIP() << "no program chromium (scripts/setup)";
  }
  const TemporaryDirectory root;
  StageStatus status = result_of({{"sheet.png", 0, {}}, {"torn.png", 9, {}}});
  const fs::path folder = root.path() / "statistics" / folder_name(status.manifest->key);
  fs::create_directories(folder);
  write_image(folder / "sheet.png", Image(2, 1, 3, 0.5F));
  std::ofstream(folder / "torn.png") << "no PNG";
  const fs::path page = root.path() / "page.html";
  const RunAccount account{
      "a capture", "2026-01-01T00:00:00Z", 3, 0, {{"track", "done", "", 1, 2}}};
  std::ofstream(page) << report_page(
      std::span(&status, 1), root.path(), {},
      {.run = account,
       .drawn = {{"statistics", plots_svg({{"strain", {0, 1, 2}, {0.1, 0.3, 0.2}}})}}});
  const BrowsedPage found = browse(page, root.path());
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

TEST(ReportPlots, Target_IsALineInsideThePlot) {
  const std::string svg =
      plots_svg({{"distance <mm>", {0, 1}, {1, 2}, 4}, {"without", {0, 1}, {1, 2}}});
  EXPECT_THAT(svg, HasSubstr("<title>target: 4</title>"));
  EXPECT_EQ(svg.find("target"), svg.rfind("target")) << "of one plot alone";
  EXPECT_THAT(svg, HasSubstr(">4</text>")) << "the plot reaches to it";
  EXPECT_EQ(thinned({"a", {0, 1}, {1, 2}, 4}, 1).target, 4);
}

TEST(ReportPage, DetailsOfAStage_AreFolded) {
  StageStatus status = result_of({{"a.txt", 1, {}}});
  status.manifest->metrics = {{"frames", 3}};
  status.manifest->inputs.emplace_back().path = "the capture";
  const std::string page = report_page(std::span(&status, 1), "w");
  const std::string section = page.substr(page.find("<h2 id=\"statistics\">"));
  std::string open = section;  // what is seen without opening anything
  for (std::size_t at = 0; (at = open.find("</summary>")) != std::string::npos;) {
    open.erase(at, open.find("</details>") + std::string("</details>").size() - at);
  }
  EXPECT_THAT(section, AllOf(HasSubstr("<summary>1 figure</summary>"), HasSubstr("the capture"),
                             HasSubstr("<summary>how it was made</summary>"),
                             HasSubstr("<summary>1 file</summary>")));
  EXPECT_THAT(open, AllOf(Not(HasSubstr("<table")), Not(HasSubstr("the capture"))));
}

TEST(ReportPage, StagesWithoutAResult_AreNotListed) {
  const StageStatus done = result_of({{"a.txt", 1, {}}});
  StageStatus none;
  none.stage = "track";
  StageStatus running = none;
  running.stage = "body";
  running.running = true;
  const std::vector<StageStatus> stages = {done, none, running};
  EXPECT_THAT(report_page(stages, "w"),
              AllOf(HasSubstr("<a href=\"#statistics\">"), Not(HasSubstr("track")),
                    HasSubstr("<th>body</th><td>none, running when this was written")));
}

/// The sentences of a page, as they are read.
std::string sentences_of(const std::string& page) {
  const std::size_t from = page.find("<div class=\"summary\">");
  std::string text;
  bool in_tag = false;
  for (const char c : page.substr(from, page.find("</div>", from) - from)) {
    in_tag = in_tag ? c != '>' : c == '<';
    if (!in_tag && c != '>') {
      text += c;
    }
  }
  return text;
}

TEST(ReportSummary, GoodAndBadFigures_AreSaidInWordsFarthestFirst) {
  const Gauge barely = {
      "labels.miou", "overlap of labels", "0.96", "at least 0.95", 0.96, 0.95, true, true};
  const Gauge best = {
      "surface.chamfer_mm", "distance of the scans", "1 mm", "at most 5", 1, 5, false, true};
  const Gauge at_limit = {
      "flatten.inverted", "inverted triangles", "0", "at most 0", 0, 0, false, true};
  const Gauge missed = {
      "track.mean_mm", "distance of joints", "8 mm", "at most 6", 8, 6, false, false};
  const Gauge worst = {
      "surface.completeness", "share that is seen", "0.5", "at least 0.9", 0.5, 0.9, true, false};
  StageStatus done = result_of({{"a.txt", 1, {}}});
  done.manifest->consent.push_back({"P", "research", ""});
  StageStatus outdated;
  outdated.stage = "track";
  outdated.state = StageStatus::State::Outdated;
  const std::vector<StageStatus> stages = {done, outdated};
  EXPECT_EQ(
      sentences_of(report_page(stages, "w", {},
                               {.gauges = {barely, at_limit, missed, best, worst},
                                .unknown = {"the error of <hands> (no hand was seen)"}})),
      "\nGood: 1 stage has a sound result, 3 of 5 figures meet their targets, best distance of "
      "the scans 1 mm (at most 5) and overlap of labels 0.96 (at least 0.95).\n"
      "Not good: share that is seen 0.5 (at least 0.9) and distance of joints 8 mm (at most 6);"
      " track is outdated.\n"
      "Not known: the error of &lt;hands&gt; (no hand was seen).\n");
}

TEST(ReportSummary, NothingJudged_IsSaidAndNotPraised) {
  EXPECT_EQ(sentences_of(report_page({}, "w")),
            "\nGood: no stage has a sound result yet.\nNot good: nothing that was checked.\n"
            "Not known: whether the results are good, since no figure of theirs has a target.\n");
  const Gauge missed = {"track.mean_mm", "", "8 mm", "at most 6", 8, 6, false, false};
  EXPECT_THAT(sentences_of(report_page({}, "w", {}, {.gauges = {missed}})),
              AllOf(HasSubstr("no figure meets its target."),
                    HasSubstr("Not good: track.mean_mm 8 mm (at most 6)."),
                    HasSubstr("Not known: nothing that has a target.")));
}

TEST(ReportSummary, WarningsOfThePage_AreCounted) {
  StageStatus status = result_of({{"a.txt", 1, {}}});
  status.manifest->consent.push_back({"P", "research", ""});
  status.manifest->warnings = {"a doubt", "error distortion-scaled [file]: a 64th"};
  EXPECT_THAT(sentences_of(report_page(std::span(&status, 1), "w")),
              HasSubstr("Not good: 1 error and 1 warning ask for attention, below."));
}

TEST(ReportSummary, NamesInSentences_EndWithAnAnd) {
  EXPECT_EQ(some_of({}, 2), "");
  EXPECT_EQ(some_of({"a"}, 2), "a");
  EXPECT_EQ(some_of({"a", "b", "c"}, 3), "a, b and c");
  EXPECT_EQ(some_of({"a", "b", "c", "d"}, 2), "a, b and 2 more");
}

TEST(ReportGauges, ErrorsOfEveryKind_AreSharesOfWhatIsAllowed) {
  const auto share = [](double number, double limit, bool at_least) {
    return share_of_allowed({"", "", "", "", number, limit, at_least});
  };
  EXPECT_DOUBLE_EQ(share(3, 6, false), 0.5);
  EXPECT_NEAR(share(0.98, 0.95, true), 0.4, 1e-12) << "2% are wrong of 5%";
  EXPECT_NEAR(share(16, 22, true), 2, 0.01) << "6 dB are twice the error";
  EXPECT_EQ(share(0, 0, false), 1);
  EXPECT_TRUE(std::isinf(share(1, 0, false)));
}

TEST(ReportGauges, OtherFigures_AreFolded) {
  const Gauge first = {"a.b", "the first", "1", "at most 2", 1, 2, false, true, true};
  const Gauge other = {"a.c", "another", "1", "at most 2", 1, 2, false, true, false};
  const std::string html = gauges_html(std::vector<Gauge>{first, other});
  EXPECT_LT(html.find("the first"), html.find("<summary>1 more figure</summary>"));
  EXPECT_LT(html.find("<summary>1 more figure</summary>"), html.find("another"));
  EXPECT_THAT(gauges_html(std::vector<Gauge>{first}), Not(HasSubstr("<details>")));
}

TEST(ReportPage, Viewer_IsAStepAway) {
  EXPECT_THAT(
      report_page({}, "/home/me/w <1>", {}, {.viewer = {.place = "w <1>/report/view"}}),
      AllOf(HasSubstr("<code>atelier view w &lt;1&gt;</code>"),
            HasSubstr("<code>atelier view w &lt;1&gt; --out w &lt;1&gt;/report/view</code>"),
            Not(HasSubstr("/home/me")), Not(HasSubstr("<a href=\"view"))));
  const std::string page = report_page({}, "w", {}, {.viewer = {.page = "view/index.html"}});
  EXPECT_THAT(page, AllOf(HasSubstr("<a href=\"view/index.html\">From every side"),
                          Not(HasSubstr("made before"))));
  EXPECT_THAT(report_page({}, "w", {}, {.viewer = {.page = "view/index.html", .is_older = true}}),
              HasSubstr("(made before these results)"));
}

TEST(ReportPage, FailedAndSkippedStages_ComeFirst) {
  const RunAccount account{"<c>",
                           "",
                           1,
                           0,
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
                           0,
                           {{"body", "skipped", reason, 0, 0},
                            {"template", "skipped", reason, 0, 0},
                            {"animate", "failed", "no such motion", 0, 0}}};
  const std::string page = report_page(stages, "w", {}, {.run = account});
  const std::string head = page.substr(0, page.find("<h2"));
  EXPECT_THAT(head,
              AllOf(HasSubstr("<b>statistics, reconstruct</b>: no consent is recorded: state"),
                    HasSubstr("<b>statistics, reconstruct</b>: a doubt of both"),
                    HasSubstr("<li class=\"error\"><b>statistics, reconstruct</b>: a 64th <span "
                              "class=\"quiet\">(distortion-scaled, file)</span>"),
                    HasSubstr("<b>body, template</b> were skipped: " + reason),
                    Not(HasSubstr("consent-none"))));
  EXPECT_LT(head.find("no such motion"), head.find("distortion-scaled"));
  EXPECT_LT(head.find("distortion-scaled"), head.find("were skipped"));
  const std::string run = page.substr(page.find("<h2 id=\"run\""));
  EXPECT_EQ(run.find(reason), run.rfind(reason)) << "the second is said to be as the first";
  EXPECT_THAT(run, HasSubstr("as body"));
}

TEST(ReportPage, FilmAndStripOfTheLastStage_ComeFirst) {
  const TemporaryDirectory root;
  StageStatus early = result_of({{"strip.png", 1, {}}});
  StageStatus last =
      result_of({{"animation.mp4", 4, {}}, {"other.png", 1, {}}, {"strip.png", 1, {}}});
  last.stage = last.manifest->stage = "animate";
  StageStatus damaged = result_of({{"later.png", 1, {}}});
  damaged.stage = damaged.manifest->stage = "damaged";
  damaged.state = StageStatus::State::Damaged;
  for (const StageStatus& status : {early, last}) {
    const fs::path folder = root.path() / status.stage / folder_name(status.manifest->key);
    fs::create_directories(folder);
    for (const ManifestOutput& output : status.manifest->outputs) {
      std::ofstream(folder / output.path) << status.stage << output.path;
    }
  }
  last.manifest->warnings = {"a doubt"};
  const std::vector<StageStatus> stages = {early, last, damaged};
  const std::string page = report_page(stages, root.path());
  const std::string head = page.substr(0, page.find("a doubt"));
  EXPECT_THAT(head, AllOf(HasSubstr("<video"), HasSubstr("alt=\"strip.png\""),
                          Not(HasSubstr("other.png"))));
  const auto times = [&](const std::string& what) {
    int count = 0;
    for (std::size_t at = 0; (at = page.find(what, at)) != std::string::npos; ++at) {
      ++count;
    }
    return count;
  };
  EXPECT_EQ(times("<video"), 1) << "not in its section as well";
  EXPECT_EQ(times("alt=\"strip.png\""), 2) << "the other stage's";
}

TEST(ReportPage, Findings_AreSaidPlainlyWithTheSettingToTry) {
  StageStatus status = result_of({{"a.txt", 1, {}}});
  status.manifest->warnings = {
      "warning sync-off [cam <3>]: the camera is late; set it -> --capture.sync cam3=2",
      "warning: no code", "warning half [open: no end"};
  const std::string page = report_page(std::span(&status, 1), "w");
  EXPECT_THAT(page, AllOf(HasSubstr("the camera is late; set it; try <code>--capture.sync "
                                    "cam3=2</code> <span class=\"quiet\">(sync-off, cam "
                                    "&lt;3&gt;)</span>"),
                          HasSubstr(": warning: no code</li>"),
                          HasSubstr(": warning half [open: no end</li>")));
}

TEST(ReportPage, FiguresThatMatter_AreDrawnBeforeTheDetails) {
  const std::vector<Gauge> gauges = {
      {"track.mean_mm", "of <joints>", "8 mm", "at most 6", 8, 6, false, false},
      {"labels.miou", "", "0.98", "at least 0.95", 0.98, 0.95, true, true},
      {"not.finite", "", "nan", "", std::nan(""), 1, false, true}};
  const std::string page = report_page({}, "w", {}, {.gauges = gauges});
  EXPECT_THAT(page, AllOf(HasSubstr("Figures that matter"), HasSubstr("of &lt;joints&gt;"),
                          HasSubstr("at most 6, missed"), HasSubstr("at least 0.95<"),
                          Not(HasSubstr("not.finite"))));
  EXPECT_EQ(gauges_html({}), "");
  EXPECT_THAT(report_page({}, "w"), Not(HasSubstr("Figures that matter")));
}

TEST(ReportPage, TargetTable_ShowsMissesAndMissingMeasurements) {
  ReportFigure missed{"track.mean_mm", "8 mm", "missed", false, "over 12 frames"};
  missed.range = "at most 6";
  missed.missed_by = "2 mm";
  missed.accuracy = "at most 5, missed by 3 mm";
  missed.words = "distance of joints";
  ReportFigure absent{"body.mean_mm", "-", "not measured", true, "there is no <result> of body"};
  absent.range = "at most 5";
  const ReportFigures figures{
      "By some ranges.", {missed, absent}, {{"track.extra", "7", "", true, "beside it"}}};
  const std::string page = report_page({}, "w", {}, {.figures = figures});
  EXPECT_THAT(
      page,
      AllOf(HasSubstr(
                "<b>track.mean_mm</b>: distance of joints 8 mm, missed by 2 mm (at most 6): over "
                "12 frames"),
            HasSubstr("<th>track.mean_mm</th><td>distance of joints</td>"),
            HasSubstr("<summary>2 figures with a target</summary>"),
            HasSubstr("0 met, 1 missed, 0 not judged, 1 not measured. By some ranges."),
            HasSubstr("<td class=\"state error\">missed</td>"),
            HasSubstr("at most 5, missed by 3 mm"), HasSubstr("there is no &lt;result&gt; of body"),
            HasSubstr("<summary>1 other figure</summary>"), HasSubstr("beside it")));
}

}  // namespace
}  // namespace atelier::fixtures
