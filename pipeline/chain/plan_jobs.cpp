#include "pipeline/chain/plan_jobs.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/io/json_text.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/row/stage_row.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

constexpr const char* kReport = "report";
constexpr double kReportMegabytes = 1500;
constexpr double kJoinSeconds = 5;  // of finding every part done and digesting what they read

/// Steps of the run that the capture has something for, in their order.
std::vector<const StageRow*> steps_to_do(const CaptureFacts& facts, const PlanOptions& options) {
  std::vector<const StageRow*> steps;
  std::set<std::string_view> absent;
  bool begun = options.from.empty();
  for (const StageRow* step : run_steps()) {
    begun = begun || step->stage.name == options.from;
    const std::vector<std::string_view> needed = needed_stages(*step, facts);
    if (!nothing_for(*step, facts).empty() ||
        std::any_of(needed.begin(), needed.end(), [&](std::string_view name) {
          return absent.contains(name) || find_row(name) == nullptr;
        })) {
      absent.insert(step->stage.name);
    } else if (begun) {
      steps.push_back(step);
    }
    if (step->stage.name == options.to) {
      break;
    }
  }
  return steps;
}

std::vector<std::string> run_words(const RunPlaces& places, const PlanOptions& options,
                                   const std::string& stage, bool has_cuda) {
  std::vector<std::string> words = {"run", places.capture.string(), places.workspace.string()};
  const auto add = [&](const char* flag, const std::string& value) {
    words.insert(words.end(), {flag, value});
  };
  if (!stage.empty()) {
    add("--from", stage);
    add("--to", stage);
  } else {
    if (!options.from.empty()) {
      add("--from", options.from);
    }
    if (!options.to.empty()) {
      add("--to", options.to);
    }
  }
  add("--jobs", std::to_string(options.threads));
  add("--threads", std::to_string(options.threads));
  if (options.cuda && has_cuda) {
    add("--device", "cuda");
  }
  words.insert(words.end(), options.words.begin(), options.words.end());
  return words;
}

/// Stages whose results a step reads, each once.
std::set<std::string_view> read_stages(const StageRow& step, const CaptureFacts& facts) {
  std::set<std::string_view> names;
  for (const auto& some : {needed_stages(step, facts), optional_stages(step)}) {
    names.insert(some.begin(), some.end());
  }
  return names;
}

/// Jobs of one stage: its parts, if it has any, and the stage.
void add_stage(const StageRow& step, const RunPlaces& places, const CaptureFacts& facts,
               const PlanOptions& options, std::vector<PlannedJob>& jobs) {
  const Stage& stage = step.stage;
  PlannedJob whole;
  whole.id = stage.name;
  whole.stage = stage.name;
  whole.writes = places.workspace / stage.name;
  whole.threads = options.threads;
  whole.reads = {places.capture};
  for (const std::string_view name : read_stages(step, facts)) {
    whole.reads.push_back(places.workspace / name);
    if (std::any_of(jobs.begin(), jobs.end(),
                    [&](const PlannedJob& one) { return one.id == name; })) {
      whole.needs.emplace_back(name);
    }
  }
  whole.command = run_words(places, options, whole.stage, stage.has_cuda);
  whole.command.emplace_back("--no-report");
  whole.seconds = expected_seconds(step, facts, options.threads);
  whole.megabytes = expected_megabytes(step, facts, options.threads);
  const int parts = std::min(options.parts, std::max(facts.frames, 1));
  if (!step.chain->splits || parts < 2) {
    jobs.push_back(whole);
    return;
  }
  std::vector<std::string> ids;
  for (int i = 0; i < parts; ++i) {
    PlannedJob part = whole;
    part.id += "." + std::to_string(i);
    part.part = i;
    part.parts = parts;
    part.command.insert(part.command.end(),
                        {"--shard", std::to_string(i) + "/" + std::to_string(parts)});
    part.seconds /= parts;
    ids.push_back(part.id);
    jobs.push_back(part);
  }
  whole.needs.insert(whole.needs.end(), ids.begin(), ids.end());
  whole.seconds = kJoinSeconds;
  jobs.push_back(whole);
}

nlohmann::ordered_json job_json(const PlannedJob& job) {
  nlohmann::ordered_json json = {{"id", job.id}, {"stage", job.stage}};
  if (job.parts > 1) {
    json["part"] = job.part;
    json["parts"] = job.parts;
  }
  json["needs"] = job.needs;
  json["command"] = job.command;
  json["reads"] = nlohmann::json::array();
  for (const std::filesystem::path& folder : job.reads) {
    json["reads"].push_back(folder.string());
  }
  json["writes"] = job.writes.string();
  json["threads"] = job.threads;
  json["expected_seconds"] = job.seconds;
  json["expected_megabytes"] = job.megabytes;
  return json;
}

}  // namespace

std::vector<PlannedJob> plan_jobs(const RunPlaces& places, const CaptureFacts& facts,
                                  const PlanOptions& options) {
  std::vector<PlannedJob> jobs;
  std::vector<std::string> stages;
  for (const StageRow* step : steps_to_do(facts, options)) {
    add_stage(*step, places, facts, options, jobs);
    stages.emplace_back(step->stage.name);
  }
  PlannedJob report;
  report.id = kReport;
  report.needs = stages;
  report.command = run_words(places, options, "", true);
  report.reads = {places.capture, places.workspace};
  report.writes = places.workspace / kReport;
  report.threads = options.threads;
  report.seconds = expected_report_seconds(facts, stages);
  report.megabytes = kReportMegabytes;
  jobs.push_back(report);
  return jobs;
}

double longest_way(const std::vector<PlannedJob>& jobs) {
  std::map<std::string, double> ends;
  double last = 0;
  for (const PlannedJob& job : jobs) {
    double begin = 0;
    for (const std::string& needed : job.needs) {
      begin = std::max(begin, ends[needed]);
    }
    last = std::max(last, ends[job.id] = begin + job.seconds);
  }
  return last;
}

std::string plan_json(const RunPlaces& places, const std::vector<PlannedJob>& jobs) {
  nlohmann::ordered_json json = {{"schema", "atelier.plan"},
                                 {"version", 1},
                                 {"capture", places.capture.string()},
                                 {"workspace", places.workspace.string()},
                                 {"jobs", nlohmann::json::array()}};
  for (const PlannedJob& job : jobs) {
    json["jobs"].push_back(job_json(job));
  }
  return json_text(json, 1);
}

}  // namespace atelier
