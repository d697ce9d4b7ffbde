#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/layouts/capture_facts.h"
#include "core/options.h"
#include "pipeline/row/chain_place.h"

namespace atelier {

/// A piece of a run that one machine does by one command, such as "body.2": the third part of the
/// stage body. A divided stage also has a job of its own name behind its parts, which finds their
/// frames and ends the stage; and "report", the last, finds every result and writes the report.
struct PlannedJob {
  std::string id;
  std::string stage;  ///< "" of the report
  int part = 0;
  int parts = 1;                             ///< 1: the whole stage, or what joins its parts
  std::vector<std::string> needs;            ///< ids of jobs that are to end before
  std::vector<std::string> command;          ///< words behind the program's name
  std::vector<std::filesystem::path> reads;  ///< folders
  std::filesystem::path writes;              ///< folder; of parts, one that they share
  int threads = 1;
  double seconds = 0;    ///< expected, as `expected_seconds`
  double megabytes = 0;  ///< expected memory of the largest process, 10^6 bytes
};

/// How a run is to be divided.
struct PlanOptions {
  std::string from;  ///< first stage; "": the first
  std::string to;    ///< last stage; "": the last
  int parts = 4;    ///< of each stage that can be divided (ChainPlace::splits); no more than frames
  int threads = 2;  ///< processor cores of a job
  bool cuda = false;               ///< `--device cuda` for the stages that have it
  std::vector<std::string> words;  ///< further words of `atelier run`: options of stages
};

/// The jobs of a run, each behind those it needs. What the capture has nothing for is left out.
/// Each is `atelier run` on one stage, with the keys of a run on one machine: what is there is not
/// done again, in whatever order and number jobs are tried.
std::vector<PlannedJob> plan_jobs(const RunPlaces& places, const CaptureFacts& facts,
                                  const PlanOptions& options);

/// Seconds of the longest way through the jobs: a job behind those that it needs, when every job
/// begins as soon as it may.
double longest_way(const std::vector<PlannedJob>& jobs);

/// The jobs as JSON for workflow engines (schema "atelier.plan", version 1).
std::string plan_json(const RunPlaces& places, const std::vector<PlannedJob>& jobs);

}  // namespace atelier
