#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/options.h"
#include "core/store/workspace_status.h"
#include "pipeline/pictures/report_gauges.h"
#include "pipeline/pictures/run_account.h"

namespace atelier {

struct ReportOptions {
  int pictures = 24;           ///< of a stage, most that are shown
  double picture_bytes = 4e6;  ///< largest that is shown, bytes; a page of tens of megabytes opens
};

OptionTable describe(ReportOptions& options);

/// A figure against the ground truth, as the page shows it.
struct ReportFigure {
  std::string name;     ///< "track.mean_mm"
  std::string value;    ///< with its unit
  std::string verdict;  ///< "met", "not judged"; outside of the table "met (at most 6)" or ""
  bool met = true;      ///< false: the page says so among what asks for attention
  std::string note;     ///< over what it was taken, or why it was not
  // Of the table of targets alone:
  std::string words = {};      ///< what it is, a noun phrase
  std::string range = {};      ///< "at most 6"
  std::string missed_by = {};  ///< "0.7 mm"
  std::string accuracy = {};   ///< "at most 5, missed by 1.7 mm"; "" where that is the range
};

/// Errors of results against the ground truth.
struct ReportFigures {
  std::string judged_by;              ///< which ranges those of the table are, a sentence
  std::vector<ReportFigure> targets;  ///< the table of targets, measured or not
  std::vector<ReportFigure> others;   ///< all other figures
};

/// The viewer's page (atelier view --out) that the report leads to.
struct ReportView {
  std::string page = {};   ///< its address from the report, "view/index.html"; "" where none is
  bool is_older = false;   ///< than a result that the report is on
  std::string place = {};  ///< where a report would find it, for a command: "work/report/view"
};

/// Content of the page beside the stages; all of it optional.
struct ReportContent {
  ReportFigures figures = {};
  std::vector<Gauge> gauges = {};                 ///< every figure that has a target
  std::vector<std::string> unknown = {};          ///< what no figure says, noun phrases
  std::optional<RunAccount> run = std::nullopt;   ///< what the last `run` of the chain came to
  std::string run_problem = {};                   ///< why there is no `run` where one should be
  std::map<std::string, std::string> drawn = {};  ///< HTML for stages' sections, by stage
                                                  ///< (stage_pictures)
  std::string subject = {};                       ///< who was captured, for the title
  ReportView viewer = {};
};

/// The report on a workspace as one HTML page that needs no other file. First the video and the
/// strip of the last stage in their order that has any, and three sentences (report_summary); then
/// what asks for attention (what failed and is damaged before all else: outdated results, ended or
/// missing consent, findings, each with the setting to try; one text of several stages once); then
/// the figures that matter as a picture, and what the last run came to. The details follow: for
/// each stage its images, videos and plots, and folded its figures, the options that somebody set,
/// its inputs and files; then every figure against the ground truth, where there is one. Every text
/// that came from a file is escaped; the page runs no script and loads nothing.
///
/// Images and videos of sound results are shown as far as the options allow, the others only
/// named: what lies at the result's top first (strips, sheets), then some of each folder's,
/// evenly. Throws EnvironmentError or DataError if an image cannot be read.
std::string report_page(std::span<const StageStatus> stages, const std::filesystem::path& workspace,
                        const ReportOptions& options = {}, const ReportContent& content = {});

/// The text as HTML shows it literally, in content and in quoted attributes.
std::string html_text(std::string_view text);

/// Some of `all` where they are more than `most`: the first, the last and as many between, evenly.
template <class Value>
std::vector<Value> spread(const std::vector<Value>& all, std::size_t most) {
  std::vector<Value> some;
  const std::size_t count = std::min(all.size(), most);
  for (std::size_t i = 0; i < count; ++i) {
    some.push_back(all[count == 1 ? 0 : i * (all.size() - 1) / (count - 1)]);
  }
  return some;
}

/// Bytes as base64, for "data:" addresses.
std::string base64_text(std::span<const std::byte> bytes);

}  // namespace atelier
