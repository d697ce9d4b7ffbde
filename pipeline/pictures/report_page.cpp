#include "pipeline/pictures/report_page.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "core/io/file_bytes.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/build_info.h"
#include "core/store/result.h"
#include "core/store/workspace_status.h"
#include "pipeline/pictures/report_summary.h"

namespace atelier {
namespace {

constexpr const char* kReportStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 64rem; margin: 2rem auto;
       padding: 0 1rem; }
h1, h2 { line-height: 1.2; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; margin: .5rem 0; }
th, td { text-align: left; padding: .15rem .8rem .15rem 0; vertical-align: top; }
th { font-weight: 600; color: #555; } td.number { text-align: right; }
td.number, td.state { white-space: nowrap; }
svg { max-width: 100%; height: auto; }
td.number, code { font-family: ui-monospace, monospace; font-size: 13px; }
td { overflow-wrap: anywhere; } figure { margin: 1rem 0; } img, video { max-width: 100%; }
.first figure { margin: .5rem 0; } .first video { max-height: 30rem; }
.attention li { margin: .35rem 0; }
figcaption, .quiet { color: #666; } .error { color: #a40000; } .warning { color: #8a5a00; }
.attention { background: #fff7e0; border-left: 4px solid #d9a400; padding: .5rem 1rem; }
.gauges td { overflow-wrap: normal; vertical-align: middle; line-height: 1.3; }
.gauges svg { max-width: none; display: block; } .gauges td:nth-child(n+3) { white-space: nowrap; }
.summary p { margin: .3rem 0; }
details { margin: .5rem 0; } summary { cursor: pointer; }
)";

/// The media type of what a browser shows, "" of everything else.
std::string media_type(const std::filesystem::path& path) {
  constexpr std::array<std::array<const char*, 2>, 6> kTypes = {{{".png", "image/png"},
                                                                 {".jpg", "image/jpeg"},
                                                                 {".jpeg", "image/jpeg"},
                                                                 {".webp", "image/webp"},
                                                                 {".avif", "image/avif"},
                                                                 {".mp4", "video/mp4"}}};
  for (const auto& [extension, type] : kTypes) {
    if (path.extension() == extension) {
      return type;
    }
  }
  return "";
}

/// A warning or an error as its parts: of a finding's line, "warning code [place]: what; advice ->
/// setting", those; of any other text the text alone.
struct Told {
  std::string code;
  std::string place;
  std::string what;     ///< and advice
  std::string setting;  ///< "--capture.sync cam3=-4"
};

Told told(const std::string& text) {
  Told parts{"", "", text, ""};
  std::size_t at = std::string::npos;
  for (const std::string_view severity : {"error ", "warning ", "note "}) {
    if (text.starts_with(severity)) {
      at = severity.size();
    }
  }
  if (at == std::string::npos) {
    return parts;
  }
  const std::size_t end = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-", at);
  if (end == at || end == std::string::npos || (text[end] != ':' && text[end] != ' ')) {
    return parts;
  }
  std::size_t rest = end;
  if (text.compare(end, 2, " [") == 0) {
    const std::size_t close = text.find("]: ", end);
    if (close == std::string::npos) {
      return parts;
    }
    parts.place = text.substr(end + 2, close - end - 2);
    rest = close + 1;
  } else if (text[end] != ':') {
    return parts;
  }
  parts.code = text.substr(at, end - at);
  parts.what = text.substr(std::min(text.size(), rest + 2));
  if (const std::size_t arrow = parts.what.rfind(" -> "); arrow != std::string::npos) {
    parts.setting = parts.what.substr(arrow + 4);
    parts.what.resize(arrow);
  }
  return parts;
}

/// The same as HTML.
std::string told_html(const std::string& text) {
  const Told parts = told(text);
  std::string html = html_text(parts.what);
  if (!parts.setting.empty()) {
    html += "; try <code>" + html_text(parts.setting) + "</code>";
  }
  if (!parts.code.empty()) {
    html += " <span class=\"quiet\">(" + html_text(parts.code) +
            (parts.place.empty() ? "" : ", " + html_text(parts.place)) + ")</span>";
  }
  return html;
}

/// Warnings of a stage that stand at the head of the page; the rest are in the stage's section.
constexpr std::size_t kWarningsFirst = 5;

std::string in_table(const std::string& rows) {
  return rows.empty() ? "" : "<table>\n" + rows + "</table>\n";
}

std::string row(const std::string& name, const std::string& cell, const char* cell_class = "") {
  return "<tr><th>" + html_text(name) + "</th><td" +
         (*cell_class != '\0' ? " class=\"" + std::string(cell_class) + "\"" : "") + ">" +
         html_text(cell) + "</td></tr>\n";
}

std::string folded(const std::string& summary, const std::string& content) {
  return content.empty() ? ""
                         : "<details><summary>" + html_text(summary) + "</summary>\n" + content +
                               "</details>\n";
}

/// Something that asks for attention, of one stage or of several alike.
struct Attention {
  bool error = false;
  std::vector<std::string> of;
  std::string end;  ///< "failed", "skipped"; "" of what is no stage's end
  std::string text;
};

void attend(std::vector<Attention>& items, Attention one) {
  for (Attention& item : items) {
    if (item.error == one.error && item.end == one.end && item.text == one.text) {
      item.of.insert(item.of.end(), one.of.begin(), one.of.end());
      return;
    }
  }
  items.push_back(std::move(one));
}

/// Where all of it is seen from every side: the viewer's page beside this one, or what makes it.
std::string view_line(const ReportView& view, const std::filesystem::path& workspace) {
  constexpr const char* kWords = "From every side, frame by frame";
  if (view.page.empty()) {
    const std::string command = html_text("atelier view " + workspace.filename().string());
    return std::string("<p class=\"quiet\">") + kWords + ": <code>" + command + "</code>" +
           (view.place.empty() ? ""
                               : "; <code>" + command + html_text(" --out " + view.place) +
                                     "</code> makes a page that the next report leads to") +
           "</p>\n";
  }
  return "<p><a href=\"" + html_text(view.page) + "\">" + kWords + "</a>" +
         (view.is_older ? " <span class=\"warning\">(made before these results)</span>" : "") +
         "</p>\n";
}

/// One list item each, errors first.
std::string list_of(std::vector<Attention> items) {
  std::stable_partition(items.begin(), items.end(),
                        [](const Attention& item) { return item.error; });
  std::string list;
  for (const Attention& item : items) {
    std::string of;
    for (const std::string& one : item.of) {
      of += of.empty() ? "" : ", ";
      of += html_text(one);
    }
    std::string end = item.end.empty() ? "" : " " + html_text(item.end);
    if (item.end == "skipped") {
      end = item.of.size() == 1 ? " was skipped" : " were skipped";
    }
    list += item.error ? "<li class=\"error\"><b>" : "<li class=\"warning\"><b>";
    list += of;
    list += "</b>";
    list += end;
    list += ": ";
    list += told_html(item.text);
    list += "</li>\n";
  }
  return list;
}

/// Items of a stage's result that ask for attention.
void attend_to(const StageStatus& status, std::vector<Attention>& items) {
  const auto item = [&](const std::string& item_class, const std::string& text) {
    attend(items, {item_class == "error", {status.stage}, "", text});
  };
  if (status.state == StageStatus::State::Damaged) {
    item("error", "the result is damaged; run the stage again");
  }
  for (const Finding& finding : status.findings) {
    item(finding.severity == Severity::Error ? "error" : "warning", to_string(finding));
  }
  for (const std::string& reason : status.reasons) {
    item("warning", "outdated: " + reason);
  }
  for (const UnfinishedWork& work : status.unfinished) {
    item("warning",
         "unfinished work of " + counted(work.frames, "frame") + "; run the stage again");
  }
  if (status.unlinked_results > 0) {
    item("warning", unlinked_text(status.unlinked_results));
  }
  const std::vector<std::string> none;
  const std::vector<std::string>& warned = status.manifest ? status.manifest->warnings : none;
  const bool no_consent = status.manifest && status.manifest->consent.empty();
  std::size_t shown = 0;
  std::size_t more = 0;
  for (const std::string& text : warned) {  // findings begin with how severe they are
    if (text.starts_with("error ")) {
      item("error", text);
    } else if (no_consent && text.starts_with("warning consent-none ")) {
      continue;  // said below
    } else if (++shown <= kWarningsFirst) {
      item("warning", text);
    } else {
      ++more;
    }
  }
  if (more > 0) {
    item("warning", std::to_string(more) + " more warnings, below");
  }
  if (no_consent) {
    item("warning",
         "no consent is recorded: state who, scope and until in a [[consent]] entry of "
         "capture.toml");
  }
}

/// The caption of an image: words where a stage's own say nothing to a reader, else its path.
std::string caption_of(const std::string& path) {
  constexpr std::string_view kFolder = "pictures/";
  constexpr std::string_view kRegion = "_region.png";
  return path.starts_with(kFolder) && path.ends_with(kRegion)
             ? path.substr(kFolder.size(), path.size() - kFolder.size() - kRegion.size()) +
                   ": the part of the body whose clothing does not count (" + path + ")"
             : path;
}

std::string picture(const std::filesystem::path& file, const std::string& name,
                    const std::string& type, std::int64_t max_bytes) {
  const std::string data =
      "data:" + type + ";base64," + base64_text(read_file_bytes(file, max_bytes));
  const std::string shown = type.starts_with("video")
                                ? "<video controls loop muted src=\"" + data + "\"></video>"
                                : "<img alt=\"" + html_text(name) + "\" src=\"" + data + "\">";
  return "<figure>" + shown + "<figcaption>" + html_text(caption_of(name)) +
         "</figcaption></figure>\n";
}

/// Whether an image is a plot for readers of the files alone: the page has plots of the same.
bool is_plot(const std::string& path) {
  return path.ends_with("_frames.png") || path.ends_with("certificates.png");
}

bool is_shown(const ManifestOutput& output, const ReportOptions& options) {
  return !is_plot(output.path) && !media_type(output.path).empty() &&
         static_cast<double>(output.size) <= options.picture_bytes;
}

/// Images that the page begins with.
struct FirstPictures {
  std::string stage;
  std::vector<std::string> paths;  ///< a video, and a strip or another image of many frames
};

/// Of the last stage with a sound result that has a video or an image at its top.
FirstPictures first_pictures(std::span<const StageStatus> stages, const ReportOptions& options) {
  for (auto status = stages.rbegin(); status != stages.rend() && options.pictures > 0; ++status) {
    if (!status->manifest || status->state == StageStatus::State::Damaged) {
      continue;
    }
    std::string video;
    std::string image;
    for (const ManifestOutput& output : status->manifest->outputs) {
      if (output.path.find('/') == std::string::npos && is_shown(output, options)) {
        std::string& place = media_type(output.path).starts_with("video") ? video : image;
        place = place.empty() || output.path.starts_with("strip") ? output.path : place;
      }
    }
    FirstPictures first{status->stage, {}};
    for (const std::string& path : {video, image}) {
      if (!path.empty()) {
        first.paths.push_back(path);
      }
    }
    if (!first.paths.empty()) {
      return first;
    }
  }
  return {};
}

std::string first_section(const FirstPictures& first, std::span<const StageStatus> stages,
                          const std::filesystem::path& workspace, const ReportOptions& options) {
  std::string html;
  for (const StageStatus& status : stages) {
    for (const std::string& path :
         status.stage == first.stage ? first.paths : std::vector<std::string>{}) {
      html += picture(
          results_of_stage(workspace, status.stage) / folder_name(status.manifest->key) / path,
          path, media_type(path), static_cast<std::int64_t>(options.picture_bytes));
    }
  }
  return html.empty() ? "" : "<div class=\"first\">\n" + html + "</div>\n";
}

/// Frames in their folder fill no page, and push out none of what shows all of them.
/// @param above  what the page has shown already
std::string pictures_of(const StageStatus& status, const std::filesystem::path& folder,
                        const ReportOptions& options, const std::vector<std::string>& above) {
  std::vector<std::string> top;     // strips, sheets and videos
  std::vector<std::string> single;  // one a frame, or a garment
  for (const ManifestOutput& output : status.manifest->outputs) {
    if (is_shown(output, options) &&
        std::find(above.begin(), above.end(), output.path) == above.end()) {
      (output.path.find('/') == std::string::npos ? top : single).push_back(output.path);
    }
  }
  const std::size_t most = static_cast<std::size_t>(options.pictures) -
                           std::min(above.size(), static_cast<std::size_t>(options.pictures));
  std::vector<std::string> shown = spread(top, most);
  std::map<std::string, std::int64_t> more;
  for (const std::vector<std::string>& all : {top, single}) {
    for (const std::string& path : all) {
      ++more[std::filesystem::path(path).parent_path().string()];
    }
  }
  const std::vector<std::string> some = spread(single, most - shown.size());
  shown.insert(shown.end(), some.begin(), some.end());
  std::string html;
  for (const std::string& path : shown) {
    --more[std::filesystem::path(path).parent_path().string()];
    html += picture(folder / path, path, media_type(path),
                    static_cast<std::int64_t>(options.picture_bytes));
  }
  for (const auto& [place, count] : more) {
    if (count > 0) {
      html += "<p class=\"quiet\">" + std::to_string(count) + " more in " +
              html_text((std::filesystem::path(status.stage) / "current" / place).string()) +
              "</p>\n";
    }
  }
  return html;
}

std::string section_of(const StageStatus& status, const std::filesystem::path& workspace,
                       const ReportOptions& options, const std::string& drawn,
                       const FirstPictures& first) {
  std::string html =
      "<h2 id=\"" + html_text(status.stage) + "\">" + html_text(status.stage) + "</h2>\n";
  if (status.row != nullptr) {
    html += "<p>" + html_text(status.row->summary) + "</p>\n";
  }
  if (!status.manifest) {
    return html + "<p class=\"quiet\">" + html_text(state_name(status.state)) + "</p>\n";
  }
  const Manifest& manifest = *status.manifest;
  if (status.state == StageStatus::State::Damaged) {
    html +=
        "<p class=\"error\">This result is damaged: its files are not what the stage wrote, and "
        "nothing of them is shown. The figures are those of the day it was made. Run the stage "
        "again.</p>\n";
  }
  std::string facts = row("state", state_name(status.state));
  facts += row("consent", to_string(manifest.consent));
  facts += row("finished", manifest.finished);
  facts += row("elapsed time, frames side by side added up", duration_text(manifest.work_seconds));
  facts += row("peak memory", bytes_text(static_cast<double>(manifest.peak_memory_bytes)));
  if (!manifest.device.empty()) {
    facts += row("device", manifest.device);
  }
  facts += row("build", manifest.build);
  std::string figures;
  for (const auto& [name, value] : manifest.metrics) {
    figures += row(name, metric_text(status.row, name, value), "number");
  }
  html += drawn;
  if (status.state != StageStatus::State::Damaged) {
    const bool above = status.stage == first.stage;
    html +=
        pictures_of(status, results_of_stage(workspace, status.stage) / folder_name(manifest.key),
                    options, above ? first.paths : std::vector<std::string>{});
  }
  html += folded(counted(static_cast<std::int64_t>(manifest.metrics.size()), "figure"),
                 in_table(figures));
  std::string warned;
  for (const std::string& line : manifest.warnings) {
    warned += "<li class=\"warning\">" + told_html(line) + "</li>\n";
  }
  html += folded(counted(static_cast<std::int64_t>(manifest.warnings.size()), "warning"),
                 warned.empty() ? "" : "<ul>\n" + warned + "</ul>\n");
  std::string set_options;
  for (const ManifestOption& option : manifest.options) {
    if (option.source != "default") {
      set_options += row(option.name, option.json + "  (" + option.source + ")");
    }
  }
  std::string inputs;
  for (const ManifestInput& input : manifest.inputs) {
    inputs += row(input.kind, input.path + ", " + counted(input.files, "file") + ", " +
                                  bytes_text(static_cast<double>(input.bytes)));
  }
  html +=
      folded("how it was made",
             in_table(facts) +
                 (set_options.empty() ? "<p class=\"quiet\">Every option has its default.</p>\n"
                                      : "<p>Options that were set:</p>\n" + in_table(set_options)) +
                 in_table(inputs));
  std::string outputs;
  for (const ManifestOutput& output : manifest.outputs) {
    outputs += row(output.path, bytes_text(static_cast<double>(output.size)), "number");
  }
  html += folded(counted(static_cast<std::int64_t>(manifest.outputs.size()), "file"),
                 in_table(outputs));
  return html;
}

std::string verdict_cell(const ReportFigure& figure) {
  return "<td class=\"" + std::string(figure.met ? "state" : "state error") + "\">" +
         html_text(figure.verdict) + "</td>";
}

/// The table of targets with what was measured, then all other figures.
std::string figures_section(const ReportFigures& figures) {
  if (figures.targets.empty() && figures.others.empty()) {
    return "";
  }
  const bool sharper = std::any_of(figures.targets.begin(), figures.targets.end(),
                                   [](const ReportFigure& one) { return !one.accuracy.empty(); });
  std::string rows =
      std::string("<tr><th>figure</th><th></th><th>value</th><th>range</th><th>verdict</th>") +
      "<th>missed by</th>" + (sharper ? "<th>target of accuracy</th>" : "") + "<th></th></tr>\n";
  std::map<std::string, std::int64_t> count;
  for (const ReportFigure& figure : figures.targets) {
    ++count[figure.verdict];
    rows += "<tr><th>" + html_text(figure.name) + "</th><td>" + html_text(figure.words) +
            "</td><td class=\"number\">" + html_text(figure.value) + "</td><td class=\"state\">" +
            html_text(figure.range) + "</td>" + verdict_cell(figure) + "<td class=\"number\">" +
            html_text(figure.missed_by) + "</td>" +
            (sharper ? "<td class=\"quiet\">" + html_text(figure.accuracy) + "</td>" : "") +
            "<td class=\"quiet\">" + html_text(figure.note) + "</td></tr>\n";
  }
  std::string html = "<h2 id=\"truth\">Errors against the ground truth</h2>\n";
  if (!figures.targets.empty()) {
    std::string counts;
    for (const char* verdict : {"met", "missed", "not judged", "not measured"}) {
      counts += (counts.empty() ? "" : ", ") + std::to_string(count[verdict]) + " " + verdict;
    }
    html += "<p>" + counts + ". " + html_text(figures.judged_by) + "</p>\n" +
            folded(counted(static_cast<std::int64_t>(figures.targets.size()), "figure") +
                       " with a target",
                   in_table(rows));
  }
  std::string others;
  for (const ReportFigure& figure : figures.others) {
    others += "<tr><th>" + html_text(figure.name) + "</th><td class=\"number\">" +
              html_text(figure.value) + "</td>" + verdict_cell(figure) + "<td class=\"quiet\">" +
              html_text(figure.note) + "</td></tr>\n";
  }
  return html + folded(counted(static_cast<std::int64_t>(figures.others.size()), "other figure"),
                       in_table(others));
}

/// How long a stage took; "then" where that was in an earlier run. "" where it is not known.
std::string took(const RunStageAccount& one) {
  return one.end == "done" ? duration_text(one.seconds)
         : (one.end == "done already" || one.end == "not asked for") && one.seconds > 0
             ? duration_text(one.seconds) + " then"
             : "";
}

/// The outcome of the last run of the chain, stage by stage.
std::string run_section(const RunAccount& run) {
  std::string rows;
  std::map<std::string, std::string> first;  // which stage each reason was said of
  for (const RunStageAccount& one : run.stages) {
    const std::string& of = first.emplace(one.why, one.stage).first->second;
    const std::string why = one.why.empty() || of == one.stage ? one.why : "as " + of;
    rows += "<tr><th><a href=\"#" + html_text(one.stage) + "\">" + html_text(one.stage) +
            "</a></th><td" + " class=\"" + (one.end == "failed" ? "state error" : "state") + "\">" +
            html_text(one.end) + "</td><td class=\"number\">" + html_text(took(one)) +
            "</td><td class=\"quiet\">" + html_text(why) + "</td></tr>\n";
  }
  return "<h2 id=\"run\">The run</h2>\n<p>" + html_text(run.started) + ", " +
         html_text(duration_text(run.seconds)) + " before this report, of <code>" +
         html_text(run.capture) + "</code></p>\n" + in_table(rows);
}

}  // namespace

OptionTable describe(ReportOptions& options) {
  return OptionTable()
      .add("pictures", options.pictures, 0, 1000, "",
           "Maximum number of images and videos shown for one stage")
      .add("picture_bytes", options.picture_bytes, 0, 1e8, "bytes",
           "Maximum size of an image or video shown; larger ones make the page larger");
}

std::string base64_text(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8U | (k < there ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= there ? kDigits[group >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

std::string html_text(std::string_view text) {
  std::string html;
  for (const char c : printable(std::string(text))) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

std::string report_page(std::span<const StageStatus> stages, const std::filesystem::path& workspace,
                        const ReportOptions& options, const ReportContent& content) {
  const auto& [figures, gauges, unknown, run, run_problem, drawn, subject, viewer] = content;
  const std::string title =
      "Atelier: " + workspace.filename().string() + (subject.empty() ? "" : ", " + subject);
  std::vector<Attention> attention;
  if (!run_problem.empty()) {
    attend(attention, {false, {"run"}, "", run_problem});
  }
  for (const RunStageAccount& one : run ? run->stages : std::vector<RunStageAccount>{}) {
    if (!one.why.empty()) {
      attend(attention, {one.end != "skipped", {one.stage}, one.end, one.why});
    }
  }
  for (const std::vector<ReportFigure>& some : {figures.targets, figures.others}) {
    for (const ReportFigure& figure : some) {
      if (!figure.met) {
        const std::string by =
            figure.missed_by.empty() ? "" : " by " + figure.missed_by + " (" + figure.range + ")";
        const std::string of = figure.note.empty() ? "" : ": " + figure.note;
        const std::string what = figure.words.empty() ? "" : figure.words + " ";
        attend(attention,
               {false, {figure.name}, "", what + figure.value + ", " + figure.verdict + by + of});
      }
    }
  }
  std::string overview;
  std::string sections;
  const FirstPictures first = first_pictures(stages, options);
  for (const StageStatus& status : stages) {
    attend_to(status, attention);
    const auto pictures = drawn.find(status.stage);
    const bool has_section = status.state != StageStatus::State::None || pictures != drawn.end();
    const std::string name = html_text(status.stage);
    if (has_section || status.running) {
      overview += "<tr><th>" + (has_section ? "<a href=\"#" + name + "\">" + name + "</a>" : name) +
                  "</th><td>" + html_text(state_name(status.state)) +
                  (status.running ? ", running when this was written" : "") + "</td></tr>\n";
    }
    if (has_section) {
      sections += section_of(status, workspace, options,
                             pictures == drawn.end() ? std::string() : pictures->second, first);
    }
  }
  const std::string chart = gauges_html(gauges);
  const auto errors = static_cast<std::size_t>(std::count_if(
      attention.begin(), attention.end(), [](const Attention& one) { return one.error; }));
  const std::string sentences =
      report_summary({stages, gauges, unknown, errors, attention.size() - errors}) +
      view_line(viewer, workspace);
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
         "img-src data:; media-src data:; style-src 'unsafe-inline'\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n<title>" +
         html_text(title) + "</title><style>" + kReportStyle + "</style></head>\n<body>\n<h1>" +
         html_text(title) + "</h1>\n" + first_section(first, stages, workspace, options) +
         sentences +
         (attention.empty() ? "<p>No warnings.</p>\n"
                            : "<div class=\"attention\"><ul>\n" + list_of(std::move(attention)) +
                                  "</ul></div>\n") +
         (chart.empty() ? "" : "<h2 id=\"figures\">Figures that matter</h2>\n" + chart) +
         (run ? run_section(*run) : in_table(overview)) + sections + figures_section(figures) +
         "<p class=\"quiet\">" + html_text(build_info()) + "</p>\n</body></html>\n";
}

}  // namespace atelier
