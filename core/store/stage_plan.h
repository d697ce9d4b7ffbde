#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/store/file_lock.h"
#include "core/store/frame_selection.h"
#include "core/store/manifest.h"
#include "core/store/stage.h"
#include "core/store/stage_events.h"

namespace atelier {

/// A user's request for a stage.
struct StageRequest {
  std::filesystem::path input;      ///< file or folder that the first stages read
  std::filesystem::path workspace;  ///< folder of results; made if it is missing
  OptionSet options;                ///< of that stage
  FrameSelection selection;         ///< of a frame-wise stage; the rest is others' work
  int jobs = 0;                     ///< frames worked on at once; 0: as many as processors
  Device device = Device::Cpu;
  bool force = false;  ///< does the work again although the result is there
};

/// The work to do, and why.
struct StagePlan {
  enum class State {
    Done,    ///< a sound result is there
    Run,     ///< all of it
    Resume,  ///< an interrupted run's frames, or its whole result, are kept
  };

  State state = State::Run;
  std::vector<std::string> reasons;   ///< why it is not done: one sentence each
  std::vector<std::string> warnings;  ///< of the workspace, a sentence each
  std::int64_t frames_kept = 0;       ///< that an interrupted or split run finished
  Manifest manifest;  ///< as far as it follows from the request: key, options, inputs
  std::vector<std::filesystem::path> input_paths;  ///< beside `manifest.inputs`
  std::vector<FileLock> input_locks;  ///< keep results that are read from being removed
  std::filesystem::path stage_folder;
  std::filesystem::path result_folder;
  std::filesystem::path staging_folder;
};

/// Digests the inputs, makes the key and looks what is there. Creates and changes nothing. Throws
/// DataError if an input is missing, damaged or holds the workspace, if the workspace is a folder
/// of other things (`workspace_problem`), or an earlier stage has no sound result; LogicError if an
/// option is out of its range; StopRequested (digest_meter.h) if `events.stop` says so while files
/// are digested. Cost: reads inputs and results once.
StagePlan plan_stage(std::span<const Stage> stages, const Stage& stage, const StageRequest& request,
                     const StageEvents& events = {});

/// True if the workspace lies inside the folder that is the request's input, where its results
/// would change the input. Throws EnvironmentError if one of the two cannot be looked at.
bool is_inside_input(const StageRequest& request);

/// Looks again at what is there: another run may have worked since. Throws StopRequested.
void judge_state(StagePlan& plan, bool force, const StageEvents& events = {});

/// The frames that a result has files of, by their names ("frames/000012.json").
std::vector<int> frames_of(const Manifest& manifest);

/// "input meshes changed (100 files, 40960 bytes -> 101 files, 41370 bytes)".
std::string input_change(const ManifestInput& before, const ManifestInput& now);

/// In what two manifests of a stage differ that follows from the request: "option
/// solver.substeps: 8 -> 20", `input_change`, "stage version 1 -> 2".
std::vector<std::string> request_changes(const Manifest& before, const Manifest& now);

}  // namespace atelier
