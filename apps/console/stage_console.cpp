#include "apps/console/stage_console.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>

#include <spdlog/spdlog.h>

#include "apps/console/standard_streams.h"
#include "core/file_kind.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/digest_meter.h"
#include "core/store/file_lock.h"
#include "core/store/result.h"

namespace atelier {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kFrames = "frames";  // StageProgress's own unit

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

/// Of a workspace whose maker may have called it anything.
std::string shown(const std::filesystem::path& path) {
  return printable(path.string());
}

const char* end_name(StageReport::End end) {
  switch (end) {
    case StageReport::End::AlreadyDone:
      return "already done";
    case StageReport::End::Done:
      return "done";
    case StageReport::End::Partial:
      return "partial";
    case StageReport::End::Stopped:
      return "stopped";
  }
  return "done";
}

const char* plan_name(StagePlan::State state) {
  switch (state) {
    case StagePlan::State::Done:
      return "done";
    case StagePlan::State::Run:
      return "run";
    case StagePlan::State::Resume:
      return "resume";
  }
  return "run";
}

nlohmann::json consent_json(const std::vector<Consent>& consent) {
  nlohmann::json json = nlohmann::json::array();
  for (const Consent& one : consent) {
    json.push_back({{"who", one.who}, {"scope", one.scope}, {"until", one.until}});
  }
  return json;
}

std::vector<std::string> warnings_of(const StagePlan& plan) {
  std::vector<std::string> warnings =
      ended_consent(plan.manifest.consent, static_cast<double>(std::time(nullptr)));
  warnings.insert(warnings.end(), plan.warnings.begin(), plan.warnings.end());
  return warnings;
}

/// The same, and what a finished result's manifest holds: what the stage found doubtful when it
/// ran.
std::vector<std::string> warnings_of(const StageReport& report) {
  std::vector<std::string> warnings = warnings_of(report.plan);
  warnings.insert(warnings.end(), report.manifest.warnings.begin(), report.manifest.warnings.end());
  return warnings;
}

void show_consent(const StagePlan& plan) {
  std::cout << "  consent: " << printable(to_string(plan.manifest.consent)) << "\n";
  for (const std::string& warning : warnings_of(plan)) {
    std::cout << "  warning: " << printable(warning) << "\n";
  }
}

/// Finished frames that lie in work that is not, for the next run to go on from: what the text says
/// are kept.
std::int64_t frames_kept(const StageReport& report) {
  switch (report.end) {
    case StageReport::End::AlreadyDone:
      return report.plan.frames_kept;  // by --force, beside the result
    case StageReport::End::Done:
      return 0;
    case StageReport::End::Partial:
      return report.frames_done;
    case StageReport::End::Stopped:
      return report.frames_total == 0 ? report.plan.frames_kept : report.frames_done;
  }
  return 0;
}

}  // namespace

StageConsole::StageConsole(const Stage& stage, bool json)
    : stage_(stage), json_(json), terminal_(!json && errors_on_terminal()) {}

StageConsole::~StageConsole() {
  clear_line();
}

void StageConsole::say(const std::string& line) {
  if (json_) {
    std::cout << json_text(nlohmann::json{{"event", "say"}, {"stage", stage_.name}, {"line", line}})
              << std::endl;
    return;
  }
  clear_line();
  spdlog::info("{}: {}", stage_.name, printable(line));
}

void StageConsole::show_progress(const StageProgress& progress) {
  if (first_frames_ < 0 && progress.unit == kFrames) {
    first_frames_ = progress.done;
  }
  const double since = std::chrono::duration<double>(Clock::now() - last_shown_).count();
  const bool last = progress.done >= progress.total;
  const double interval = terminal_ ? 0.1 : json_ ? 0.5 : 5.0;
  if (since < interval && !last) {
    return;
  }
  last_shown_ = Clock::now();
  const bool bytes = progress.unit == kDigestUnit;
  const bool all_known = rest_ > 0 && !bytes;  // digesting says nothing of the work
  if (json_) {
    nlohmann::json json = {{"event", "progress"},
                           {"stage", stage_.name},
                           {"unit", progress.unit},
                           {"done", progress.done},
                           {"total", progress.total},
                           {"per_second", progress.per_second},
                           {"seconds_left", progress.seconds_left}};
    for (const auto& [name, value] : progress.figures) {
      json["figures"][name] = value;
    }
    if (all_known && progress.per_second > 0) {
      json["seconds_left_in_all"] = progress.seconds_left + rest_;
    }
    std::cout << json_text(json) << std::endl;
    return;
  }
  const auto amount = [&](std::int64_t count) {
    return bytes ? bytes_text(static_cast<double>(count)) : std::to_string(count);
  };
  std::string line = std::string(stage_.name) + "  " + amount(progress.done) + "/" +
                     amount(progress.total) + " " + (bytes ? "digested" : progress.unit);
  // The first frame may do the work of those behind it: `register` goes through all of a window.
  const bool alone = progress.unit == kFrames && progress.done <= first_frames_;
  if (progress.per_second > 0 && !alone) {
    const std::string per_second =
        bytes ? bytes_text(progress.per_second)
              : format(progress.per_second < 100 ? "%.3g" : "%.0f", progress.per_second);
    line += "  " + per_second + "/s  " + duration_text(progress.seconds_left) + " left" +
            (all_known ? ", " + duration_text(progress.seconds_left + rest_) + " in all" : "");
  }
  for (const auto& [name, value] : progress.figures) {
    line += "  " + name + " " + format("%.4g", value);
  }
  if (terminal_) {
    standard_error() << "\r" + line + "\033[K";
    line_shown_ = true;
  } else {
    spdlog::info("{}", line);
  }
}

void StageConsole::show_plan(const StagePlan& plan, const FrameSelection& selection) {
  const bool running =
      plan.state != StagePlan::State::Done && FileLock::is_held(plan.stage_folder / ".lock");
  const std::string part = selection.everything() ? "" : to_string(selection);
  if (json_) {
    std::cout << json_text(nlohmann::json{{"event", "plan"},
                                          {"stage", stage_.name},
                                          {"state", plan_name(plan.state)},
                                          {"reasons", plan.reasons},
                                          {"frames_kept", plan.frames_kept},
                                          {"selection", part},
                                          {"running", running},
                                          {"key", hex(plan.manifest.key)},
                                          {"result", plan.result_folder.string()},
                                          {"consent", consent_json(plan.manifest.consent)},
                                          {"warnings", warnings_of(plan)}})
              << std::endl;
    return;
  }
  if (plan.state == StagePlan::State::Done) {
    std::cout << stage_.name << " would do nothing: " << shown(plan.result_folder) << " is sound\n";
  } else {
    std::cout << stage_.name
              << (plan.state == StagePlan::State::Resume ? " would go on" : " would run")
              << ", since\n";
    for (const std::string& reason : plan.reasons) {
      std::cout << "  " << printable(reason) << "\n";
    }
    if (plan.state == StagePlan::State::Resume) {
      std::cout << "  " << counted(plan.frames_kept, "frame") << " of an interrupted run "
                << (plan.frames_kept == 1 ? "is" : "are") << " kept\n";
    }
    if (!part.empty()) {
      std::cout << "  only " << part << "\n";
    }
    if (running) {
      std::cout << "  another run is working on it now: until that ends, "
                << (part.empty() ? "this one would be refused"
                                 : "this one would be refused unless its frames are others")
                << "\n";
    }
    std::cout << "  into " << shown(plan.result_folder) << "\n";
  }
  for (const ManifestInput& input : plan.manifest.inputs) {
    std::cout << "  input " << input.kind << ": " << printable(input.path) << ", "
              << counted(input.files, "file") << ", "
              << bytes_text(static_cast<double>(input.bytes)) << "\n";
  }
  show_consent(plan);
}

/// How to go on after a stop.
std::string StageConsole::goes_on(const StageReport& report) const {
  if (!forced_) {
    return "the same command goes on from there";
  }
  if (link_kind(report.plan.result_folder) == std::filesystem::file_type::not_found) {
    return "the same command without --force goes on from there";
  }
  return std::string("the older result stays; --force starts over") +
         (report.frames_total > 0 ? ", and with --frames of the others goes on from there" : "");
}

void StageConsole::show_report(const StageReport& report) {
  const bool finished =
      report.end == StageReport::End::Done || report.end == StageReport::End::AlreadyDone;
  if (json_) {
    nlohmann::json json = {{"event", "end"},
                           {"stage", stage_.name},
                           {"end", end_name(report.end)},
                           {"reasons", report.plan.reasons},
                           {"key", hex(report.plan.manifest.key)},
                           {"frames_done", report.frames_done},
                           {"frames_total", report.frames_total},
                           {"frames_kept", frames_kept(report)},
                           {"consent", consent_json(report.plan.manifest.consent)},
                           {"warnings", warnings_of(report)}};
    if (finished) {
      json["result"] = report.plan.result_folder.string();
      json["metrics"] = report.manifest.metrics;
      json["outputs"] = report.manifest.outputs.size();
      json["work_seconds"] = report.manifest.work_seconds;
      json["peak_memory_bytes"] = report.manifest.peak_memory_bytes;
    }
    std::cout << json_text(json) << std::endl;
    return;
  }
  clear_line();
  switch (report.end) {
    case StageReport::End::AlreadyDone:
      std::cout << stage_.name << " is done already: " << shown(report.plan.result_folder) << "\n";
      if (frames_kept(report) > 0) {
        std::cout << "  beside it lies unfinished work of " << counted(frames_kept(report), "frame")
                  << " by --force: --force with the other frames finishes it, atelier gc removes "
                     "it\n";
      }
      break;
    case StageReport::End::Done:
      std::cout << stage_.name << " done: " << shown(report.plan.result_folder) << ", "
                << counted(static_cast<std::int64_t>(report.manifest.outputs.size()), "file")
                << ", " << duration_text(report.manifest.work_seconds) << " of work, "
                << bytes_text(static_cast<double>(report.manifest.peak_memory_bytes))
                << " of memory\n";
      break;
    case StageReport::End::Partial:
      std::cout << stage_.name << ": " << report.frames_done << " of " << report.frames_total
                << " frames are done" << (report.again ? " again" : "")
                << "; the rest is left to other runs\n";
      if (report.again) {
        std::cout << "  until then the older result stays: " << shown(report.plan.result_folder)
                  << "\n";
      }
      break;
    case StageReport::End::Stopped:
      if (report.frames_total == 0 && std::filesystem::exists(report.plan.staging_folder)) {
        std::cout << stage_.name << " stopped: what it had saved is kept; " << goes_on(report)
                  << "\n";
        return;
      }
      if (report.frames_total == 0) {
        std::cout << stage_.name << " stopped before its work began; nothing was changed\n";
        return;
      }
      std::cout << stage_.name << " stopped: " << frames_kept(report) << " of "
                << report.frames_total << " frames are finished and kept; " << goes_on(report)
                << "\n";
      break;
  }
  if (finished) {
    for (const auto& [name, value] : report.manifest.metrics) {
      std::cout << "  " << name << " " << metric_text(&stage_, name, value) << "\n";
    }
  }
  show_consent(report.plan);
  if (report.end == StageReport::End::AlreadyDone) {  // any other run has said them as they came
    const std::vector<std::string>& warned = report.manifest.warnings;
    const std::size_t shown_here = std::min<std::size_t>(warned.size(), 10);
    for (std::size_t i = 0; i < shown_here; ++i) {
      // Findings of files say themselves that they are warnings.
      std::cout << (warned[i].starts_with("warning") ? "  " : "  warning: ") << printable(warned[i])
                << "\n";
    }
    if (shown_here < warned.size()) {
      std::cout << "  and "
                << counted(static_cast<std::int64_t>(warned.size() - shown_here), "warning")
                << " more, which --json says\n";
    }
  }
}

void StageConsole::show_error(const Failure& failure) {
  if (json_) {
    show_error_event("stage", stage_.name, failure);
  }
}

void StageConsole::clear_line() {
  if (line_shown_) {
    standard_error() << "\r\033[K";
    line_shown_ = false;
  }
}

void show_error_event(const char* kind, std::string_view name, const Failure& failure) {
  std::cout << json_text(nlohmann::json{{"event", "error"},
                                        {kind, name},
                                        {"file", failure.file},
                                        {"where", failure.where},
                                        {"found", failure.found},
                                        {"expected", failure.expected},
                                        {"exit_code", failure.exit_code}})
            << std::endl;
}

}  // namespace atelier
