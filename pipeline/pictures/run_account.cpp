#include "pipeline/pictures/run_account.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/io/json_text.h"
#include "core/quantity_text.h"
#include "pipeline/pictures/report_folder.h"

namespace atelier {
namespace {

constexpr const char* kAccountSchema = "atelier.run";

std::filesystem::path account_file(const std::filesystem::path& workspace) {
  return report_folder(workspace) / "run.json";
}

double seconds_at(const JsonPlace& place) {
  const double seconds = place.number();
  if (!(seconds >= 0)) {
    place.fail(short_number(seconds), "seconds, at least 0");
  }
  return seconds;
}

const std::string& end_at(const JsonPlace& place) {
  constexpr std::array<std::string_view, 5> kEnds = {"done", "done already", "skipped", "failed",
                                                     "not asked for"};
  const std::string& end = place.text();
  if (std::find(kEnds.begin(), kEnds.end(), end) == kEnds.end()) {
    place.fail("'" + end.substr(0, 60) + "'", "how a stage ends");
  }
  return end;
}

}  // namespace

std::string run_account_text(const RunAccount& account) {
  nlohmann::ordered_json json = {
      {"schema", kAccountSchema},   {"version", 1},
      {"capture", account.capture}, {"started", account.started},
      {"seconds", account.seconds}, {"report_seconds", account.report_seconds}};
  json["stages"] = nlohmann::ordered_json::array();
  for (const RunStageAccount& one : account.stages) {
    json["stages"].push_back({{"stage", one.stage},
                              {"end", one.end},
                              {"why", one.why},
                              {"expected", one.expected},
                              {"seconds", one.seconds}});
  }
  return json_text(json, 1) + "\n";
}

RunAccount parse_run_account(std::string_view text, const std::string& file) {
  const nlohmann::json parsed = parse_json(text, file);
  const JsonPlace root(parsed, file);
  if (root.at("schema").text() != kAccountSchema || root.at("version").integer(0, 1 << 20) != 1) {
    root.fail("another schema", std::string(kAccountSchema) + ", version 1");
  }
  RunAccount account;
  account.capture = root.at("capture").text();
  account.started = root.at("started").text();
  account.seconds = seconds_at(root.at("seconds"));
  if (const auto report = root.find("report_seconds")) {  // since version 0.2 of the program
    account.report_seconds = seconds_at(*report);
  }
  for (const JsonPlace& one : root.at("stages").items()) {
    account.stages.push_back({one.at("stage").text(), end_at(one.at("end")), one.at("why").text(),
                              seconds_at(one.at("expected")), seconds_at(one.at("seconds"))});
  }
  return account;
}

void keep_times(const RunAccount& earlier, RunAccount& account) {
  for (RunStageAccount& one : account.stages) {
    if (one.end != "done already" && one.end != "not asked for") {
      continue;
    }
    const auto same = std::find_if(earlier.stages.begin(), earlier.stages.end(),
                                   [&](const auto& other) { return other.stage == one.stage; });
    const bool made =
        same != earlier.stages.end() && same->end != "failed" && same->end != "skipped";
    one.seconds = made ? same->seconds : 0;
  }
}

void write_run_account(const std::filesystem::path& workspace, const RunAccount& account) {
  const FileLock lock = lock_report_folder(workspace);
  write_file_atomically(account_file(workspace), run_account_text(account));
}

std::optional<RunAccount> read_run_account(const std::filesystem::path& workspace) {
  const std::filesystem::path file = account_file(workspace);
  if (!std::filesystem::exists(file)) {
    return std::nullopt;
  }
  return parse_run_account(read_file_text(file, Limits().text_file_bytes), file.string());
}

}  // namespace atelier
