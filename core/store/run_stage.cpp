#include "core/store/run_stage.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <system_error>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/new_folders.h"
#include "core/store/active_run.h"
#include "core/store/build_info.h"
#include "core/store/commit.h"
#include "core/store/frame_log.h"
#include "core/store/input_digest.h"
#include "core/store/manifest_limits.h"
#include "core/store/result.h"

namespace atelier {
namespace {

/// Removes what a run leaves that does not commit, unless a frame is finished or work was kept: the
/// next run goes on from those, half a result is worth nothing. Of shards the last one that ends
/// does so: the others may have begun a frame.
class StagingGuard {
 public:
  StagingGuard(const StagePlan& plan, FileLock& lock) : plan_(plan), lock_(lock) {}
  ~StagingGuard() {
    try {
      std::error_code ignored;
      if (armed_ && lock_.try_exclusive() && read_frame_logs(plan_.staging_folder).empty() &&
          !std::filesystem::exists(scratch_of(plan_.staging_folder), ignored)) {
        std::filesystem::remove_all(plan_.staging_folder, ignored);
      }
    } catch (const std::exception&) {  // it stays: the run's own error is what counts
    }
  }
  StagingGuard(const StagingGuard&) = delete;
  StagingGuard& operator=(const StagingGuard&) = delete;
  void release() { armed_ = false; }

 private:
  const StagePlan& plan_;
  FileLock& lock_;
  bool armed_ = true;
};

/// Takes away what a run made that came to nothing: a stage's folder in which nothing is but locks,
/// and the folders above it that were missing before.
class BareFolderGuard {
 public:
  BareFolderGuard(const StageRequest& request, const StagePlan& plan)
      : stage_folder_(plan.stage_folder), above_(request.workspace) {}
  ~BareFolderGuard() {
    try {
      remove_bare_stage_folder(stage_folder_);
    } catch (const EnvironmentError&) {  // it stays: the run's own error is what counts
    }
    above_.remove_empty();
  }
  BareFolderGuard(const BareFolderGuard&) = delete;
  BareFolderGuard& operator=(const BareFolderGuard&) = delete;

 private:
  const std::filesystem::path stage_folder_;
  const NewFolders above_;
};

FileLock lock_stage(const Stage& stage, const StageRequest& request, const StagePlan& plan) {
  const FileLock::Mode mode =
      request.selection.everything() ? FileLock::Mode::Exclusive : FileLock::Mode::Shared;
  // A look at the workspace (`workspace_status`) takes the lock for a moment: no run to yield to.
  constexpr int kTries = 5;
  constexpr std::chrono::milliseconds kPause(10);
  auto lock = FileLock::try_lock(plan.stage_folder / ".lock", mode);
  for (int i = 1; i < kTries && !lock; ++i) {
    std::this_thread::sleep_for(kPause);
    lock = FileLock::try_lock(plan.stage_folder / ".lock", mode);
  }
  if (!lock) {
    throw EnvironmentError(
        plan.stage_folder.string(),
        "another run is working on '" + std::string(stage.name) + "' here; wait until it ends" +
            (stage.frame_wise ? ", or split the work: --shard i/n on each run" : ""));
  }
  return std::move(*lock);
}

/// Nothing in the workspace may lead out of it.
void open_stage_folder(const StageRequest& request, const StagePlan& plan) {
  make_private_directory(request.workspace);
  if (link_kind(plan.stage_folder) != std::filesystem::file_type::not_found) {
    require_folder(plan.stage_folder);
  } else {
    make_private_directory(plan.stage_folder);
  }
}

/// A staging folder that an interrupted run left complete, up to the rename.
std::optional<Manifest> complete_staging(const StagePlan& plan, const StageEvents& events) {
  try {
    Manifest manifest = read_manifest(plan.staging_folder, plan.manifest.stage);
    if (manifest.key != plan.manifest.key) {
      return std::nullopt;
    }
    for (const Finding& finding :
         check_outputs(plan.staging_folder, manifest, Check::Digests, events)) {
      if (finding.severity == Severity::Error && finding.code != "output-extra") {
        return std::nullopt;
      }
    }
    return manifest;
  } catch (const DataError&) {
    return std::nullopt;
  }
}

void require_same_inputs(const Stage& stage, const StagePlan& plan) {
  for (std::size_t i = 0; i < plan.input_paths.size(); ++i) {
    const ConsentPart consent =
        plan.manifest.inputs[i].stage.empty() ? consent_part(stage) : ConsentPart::Apart;
    if (stamp_of_input(plan.input_paths[i], consent) != plan.manifest.inputs[i].stamp) {
      throw DataError(plan.input_paths[i].string(), "", "files that changed while the stage ran",
                      "an input that rests; run the stage again");
    }
  }
}

void make_current(const StagePlan& plan) {
  const std::string name = plan.result_folder.filename().string();
  if (current_name(plan.stage_folder) != name) {
    const FileLock moment =
        FileLock::wait(plan.stage_folder / ".commit-lock", FileLock::Mode::Exclusive);
    set_current(plan.stage_folder, name);
  }
}

/// Renews the parts of a manifest that are not in the key, where they have changed: consent, places
/// times and sketches of the inputs.
void renew_account(StageReport& report) {
  const StagePlan& plan = report.plan;
  const auto same_place = [](const ManifestInput& a, const ManifestInput& b) {
    return a.path == b.path && a.stamp == b.stamp && a.sketch == b.sketch;
  };
  report.manifest = read_manifest(plan.result_folder, plan.manifest.stage);
  if (report.manifest.consent == plan.manifest.consent &&
      std::equal(report.manifest.inputs.begin(), report.manifest.inputs.end(),
                 plan.manifest.inputs.begin(), plan.manifest.inputs.end(), same_place)) {
    return;
  }
  const FileLock moment =
      FileLock::wait(plan.stage_folder / ".commit-lock", FileLock::Mode::Exclusive);
  report.manifest = read_manifest(plan.result_folder, plan.manifest.stage);
  report.manifest.consent = plan.manifest.consent;
  report.manifest.inputs = plan.manifest.inputs;
  replace_manifest(plan.result_folder, report.manifest);
}

/// Of a result that this run found whole: all its frames are there, whoever made them.
void count_frames(const Stage& stage, StageReport& report) {
  if (stage.frame_wise) {
    report.frames_done = static_cast<std::int64_t>(frames_of(report.manifest).size());
    report.frames_total = report.frames_done;
  }
}

void end_already_done(const Stage& stage, StageReport& report) {
  make_current(report.plan);
  report.end = StageReport::End::AlreadyDone;
  renew_account(report);
  count_frames(stage, report);
  // Of a split run with --force that never came to its end.
  report.plan.frames_kept =
      static_cast<std::int64_t>(read_frame_logs(report.plan.staging_folder).size());
}

/// Readies the staging folder. True if there was nothing left but to commit it, which is done.
bool open_staging(const Stage& stage, const StageRequest& request, const StageEvents& events,
                  StageReport& report) {
  const StagePlan& plan = report.plan;
  const FileLock moment =
      FileLock::wait(plan.stage_folder / ".commit-lock", FileLock::Mode::Exclusive);
  if (link_kind(plan.staging_folder) != std::filesystem::file_type::not_found) {
    if (!request.force) {
      if (auto manifest = complete_staging(plan, events)) {
        manifest->consent = plan.manifest.consent;  // as it is stated now
        manifest->inputs = plan.manifest.inputs;
        commit_result(plan.staging_folder, plan.result_folder, *manifest);
        report.manifest = *manifest;
        count_frames(stage, report);
        return true;
      }
    }
    const bool resumes = stage.frame_wise || link_kind(scratch_of(plan.staging_folder)) ==
                                                 std::filesystem::file_type::directory;
    const bool keep = resumes && !(request.force && request.selection.everything()) &&
                      link_kind(plan.staging_folder) == std::filesystem::file_type::directory;
    if (!keep) {
      remove_folder(plan.staging_folder);
    }
  }
  make_private_directory(plan.staging_folder);
  return false;
}

/// Ends a run that leaves frames to others. With --force the older result lies there until the last
/// of them commits, by which the staging folder goes: only then is the new one there.
void end_partial(const Stage& stage, const StageRequest& request, const StageEvents& events,
                 StageReport& report) {
  const std::vector<std::string> reasons = report.plan.reasons;
  const bool committed =
      link_kind(report.plan.staging_folder) == std::filesystem::file_type::not_found;
  if (!request.force || committed) {
    judge_state(report.plan, false, events);
    if (report.plan.state == StagePlan::State::Done) {
      end_already_done(stage, report);  // another shard was last
      return;
    }
  }
  report.plan.reasons = reasons;
  report.end = StageReport::End::Partial;
  report.again = request.force &&
                 link_kind(report.plan.result_folder) != std::filesystem::file_type::not_found;
}

/// The same, with what whoever frees space or memory need not fear for.
EnvironmentError with_frames_kept(const EnvironmentError& error, std::int64_t frames) {
  return {error.place, error.reason + "; " + std::to_string(frames) +
                           (frames == 1 ? " finished frame is kept" : " finished frames are kept")};
}

/// The work itself, in a staging folder that is ready.
void run_and_commit(const Stage& stage, const StageRequest& request, const StageEvents& events,
                    ActiveRun& run, StagingGuard& guard, StageReport& report) {
  stage.run(run);
  report.frames_done = run.frames_done();
  report.frames_total = run.frames_total();
  if (run.stopped()) {
    report.end = StageReport::End::Stopped;
    return;
  }
  if (run.frames_missing()) {
    end_partial(stage, request, events, report);
    return;
  }
  ATELIER_CHECK(!stage.frame_wise || run.asked_for_frames(),
                std::string(stage.name) + " is said to be frame-wise, but has no each_frame");
  require_same_inputs(stage, report.plan);
  report.manifest = run.finished_manifest();
  report.manifest.build = build_info();
  // The manifest must be one that a later run accepts.
  parse_manifest(manifest_text(report.manifest), "manifest.json", manifest_limits());
  std::optional<FileLock> moment;
  if (!stage.frame_wise) {
    moment = FileLock::wait(report.plan.stage_folder / ".commit-lock", FileLock::Mode::Exclusive);
  }
  guard.release();
  commit_result(report.plan.staging_folder, report.plan.result_folder, report.manifest);
  report.end = StageReport::End::Done;
}

void work_on(std::span<const Stage> stages, const Stage& stage, const StageRequest& request,
             const StageEvents& events, StageReport& report) {
  report.plan = plan_stage(stages, stage, request, events);
  if (report.plan.state == StagePlan::State::Done) {
    end_already_done(stage, report);
    return;
  }
  const BareFolderGuard bare(request, report.plan);
  open_stage_folder(request, report.plan);
  FileLock lock = lock_stage(stage, request, report.plan);
  const std::vector<std::string> reasons = report.plan.reasons;
  judge_state(report.plan, request.force, events);  // another run may have ended meanwhile
  if (report.plan.state == StagePlan::State::Done) {
    end_already_done(stage, report);
    return;
  }
  report.plan.reasons = reasons;
  if (open_staging(stage, request, events, report)) {
    report.end = StageReport::End::Done;
    return;
  }
  ActiveRun run(stage, request, report.plan, events);
  StagingGuard guard(report.plan, lock);
  try {
    run_and_commit(stage, request, events, run, guard, report);
  } catch (const EnvironmentError& error) {
    if (run.frames_done() == 0) {
      throw;
    }
    throw with_frames_kept(error, run.frames_done());
  }
}

}  // namespace

StageReport run_stage(std::span<const Stage> stages, const Stage& stage,
                      const StageRequest& request, const StageEvents& events) {
  ATELIER_CHECK(stage.frame_wise || request.selection.everything(),
                std::string(stage.name) + " cannot be split");
  StageReport report;
  try {
    work_on(stages, stage, request, events, report);
  } catch (const StopRequested&) {
    report.end = StageReport::End::Stopped;
  }
  for (const auto& [name, value] : report.manifest.metrics) {
    const StageMetric* metric = find_metric(stage, name);
    report.input_errors |= metric != nullptr && metric->input_errors && value > 0;
  }
  return report;
}

}  // namespace atelier
