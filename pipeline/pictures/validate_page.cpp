#include "pipeline/pictures/validate_page.h"

#include <algorithm>
#include <cstdlib>

#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/validate_drawings.h"

namespace atelier {
namespace {

constexpr const char* kStyle = R"(
:root { --ink: #22262b; --quiet: #6b7280; --line: #e3e5e8; --good: #3b7a57; --warn: #b87400; --bad: #b3261e; }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); max-width: 74rem; margin: 0 auto;
       padding: 2rem 1.5rem 4rem; background: #fff; }
h1 { font-size: 1.6rem; margin: 0; } h2 { font-size: 1.15rem; margin: 2.6rem 0 .8rem; }
.quiet, figcaption { color: var(--quiet); } code { font: 13px ui-monospace, monospace; }
.verdict { border-left: 6px solid; border-radius: 6px; padding: .9rem 1.2rem; margin: 1.2rem 0;
           background: #f7f8f9; }
.verdict b { font-size: 1.1rem; } .verdict.error { border-color: var(--bad); }
.verdict.warning { border-color: var(--warn); } .verdict.note { border-color: var(--good); }
.facts { display: flex; flex-wrap: wrap; gap: .4rem 2rem; margin: .6rem 0 0; }
.facts span b { font-weight: 600; }
pre { background: #1f2429; color: #e8eaed; padding: .8rem 1rem; border-radius: 6px; overflow-x: auto;
      font: 13px/1.6 ui-monospace, monospace; }
table { border-collapse: collapse; width: 100%; }
th { text-align: left; color: var(--quiet); font-weight: 600; font-size: .85rem; }
th, td { padding: .5rem .8rem .5rem 0; border-bottom: 1px solid var(--line); vertical-align: top;
         overflow-wrap: anywhere; }
td:nth-child(1) { width: 5.5rem; } td:nth-child(2) { width: 10rem; }
.pill { display: inline-block; border-radius: 99px; padding: 0 .6rem; color: #fff; font-size: .8rem; }
.pill.error { background: var(--bad); } .pill.warning { background: var(--warn); }
.pill.note { background: #7b8794; }
td code { background: #eef1f4; border-radius: 4px; padding: .1rem .35rem; }
.row { display: flex; flex-wrap: wrap; gap: 1.5rem; align-items: flex-start; }
.row > svg { max-width: 100%; height: auto; border-radius: 6px; }
.sheet { display: grid; grid-template-columns: repeat(auto-fill, minmax(13rem, 1fr)); gap: .8rem; }
.view { margin: 0; } .view svg { width: 100%; height: auto; border-radius: 6px; display: block; }
.view figcaption { font-size: .85rem; font-weight: 600; }
.key i { display: inline-block; width: .8rem; height: .8rem; border-radius: 99px; margin: 0 .3rem 0 1rem;
         vertical-align: -1px; }
)";

std::string finding_row(const Finding& finding) {
  const std::string severity = severity_name(finding.severity);
  std::string cell = html_text(finding.what);
  if (!finding.advice.empty()) {
    cell += "<br><span class=\"quiet\">" + html_text(finding.advice) + "</span>";
  }
  if (!finding.setting.empty()) {
    cell += "<br><code>" + html_text(finding.setting) + "</code>";
  }
  return "<tr><td><span class=\"pill " + severity + "\">" + severity + "</span></td><td><b>" +
         html_text(finding.code) + "</b><br><span class=\"quiet\">" + html_text(finding.place) +
         "</span></td><td>" + cell + "</td></tr>\n";
}

std::string verdict_of(const std::vector<Finding>& findings) {
  int errors = 0;
  int warnings = 0;
  for (const Finding& finding : findings) {
    errors += finding.severity == Severity::Error ? 1 : 0;
    warnings += finding.severity == Severity::Warning ? 1 : 0;
  }
  const auto counted = [](int count, const std::string& what) {
    return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
  };
  const std::string counts = counted(errors, "error") + ", " + counted(warnings, "warning");
  if (errors > 0) {
    return "<div class=\"verdict error\"><b>The capture cannot be used as it is.</b><br>" + counts +
           "</div>\n";
  }
  if (warnings > 0) {
    return "<div class=\"verdict warning\"><b>The capture can be used.</b><br>" + counts +
           "</div>\n";
  }
  return "<div class=\"verdict note\"><b>No defects were found.</b></div>\n";
}

/// Frames of the sheets: those that an error names, then the first, the middle and the last.
std::vector<int> frames_shown(const Dataset& dataset, const std::vector<Finding>& findings) {
  constexpr std::size_t kSheets = 3;
  const std::vector<int> ids = frame_ids(dataset);
  std::vector<int> chosen;
  const auto choose = [&](int id) {
    if (chosen.size() < kSheets && std::find(chosen.begin(), chosen.end(), id) == chosen.end() &&
        std::binary_search(ids.begin(), ids.end(), id)) {
      chosen.push_back(id);
    }
  };
  if (ids.empty()) {
    return chosen;
  }
  choose(ids[ids.size() / 2]);
  for (const Finding& finding : findings) {
    const std::size_t at = finding.place.rfind(" frame ");
    if (at != std::string::npos && finding.severity != Severity::Note) {
      choose(std::atoi(finding.place.c_str() + at + 7));
    }
  }
  choose(ids.front());
  choose(ids.back());
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace

std::string validate_page(FrameReader& reader, const Validation& validation,
                          const std::string& name) {
  const Dataset& dataset = reader.dataset();
  const std::vector<Finding>& findings = validation.findings;
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
      "style-src 'unsafe-inline'; img-src data:\">\n<title>" +
      html_text(name) + ": validation</title>\n<style>" + kStyle + "</style></head><body>\n";
  html += "<h1>" + html_text(name) + "</h1>\n<div class=\"facts\"><span><b>" +
          html_text(dataset.layout) + "</b> <span class=\"quiet\">" + html_text(dataset.evidence) +
          "</span></span><span><b>" + std::to_string(dataset.cameras.size()) +
          "</b> cameras</span><span><b>" + std::to_string(frame_ids(dataset).size()) +
          "</b> frames</span><span>consent: " + html_text(to_string(dataset.info.consent)) +
          "</span></div>\n";
  html += verdict_of(findings);
  const std::vector<std::string> settings = settings_of(findings);
  if (!settings.empty()) {
    html +=
        "<p>Options that correct the capture as far as options can; every command that reads the "
        "capture accepts them:</p>\n<pre>";
    for (const std::string& setting : settings) {
      html += html_text(setting) + "\n";
    }
    html += "</pre>\n";
  }
  if (!findings.empty()) {
    html +=
        "<h2>Findings</h2>\n<table><tr><th>severity</th><th>finding, place</th><th>found; "
        "remedy</th></tr>\n";
    for (const Finding& finding : findings) {
      html += finding_row(finding);
    }
    html += "</table>\n";
  }
  const KeypointCheck& keypoints = validation.keypoints;
  html += "<h2>Cameras</h2>\n<div class=\"row\">" +
          camera_layout_svg(dataset, keypoints, findings) + "</div>\n";
  if (!keypoints.found.frames.empty()) {
    html +=
        "<h2>Reprojection errors</h2>\n<p class=\"quiet\">Of the person's keypoints in space, "
        "in pixels of an image 1000 rows high.</p>\n<div class=\"row\">" +
        camera_error_svg(dataset, keypoints) + joint_error_svg(dataset, keypoints) +
        "</div>\n<div class=\"row\">" + frame_error_svg(dataset, keypoints) + "</div>\n";
  }
  const std::vector<int> shown = frames_shown(dataset, findings);
  for (const int frame : shown) {
    if (frame == shown.front()) {
      html +=
          "<h2>Contact sheets</h2>\n<p class=\"key quiet\">"
          "<i style=\"border:2px solid #3dff8b\"></i>detected"
          "<i style=\"background:#1f77d0\"></i>left in space, projected back"
          "<i style=\"background:#e0562b\"></i>right"
          "<i style=\"background:#ffdc00\"></i>rim of the mask"
          "<i style=\"background:#fff;border:1px dashed #888\"></i>epipolar line of the nose</p>\n";
    }
    html += "<h3>frame " + std::to_string(frame) + "</h3>\n<div class=\"sheet\">\n" +
            contact_sheet_html(reader, keypoints, frame, findings) + "</div>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace atelier
