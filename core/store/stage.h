#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device.h"
#include "core/finding.h"
#include "core/options.h"
#include "core/store/consent.h"

namespace atelier {

/// Path of the file of each frame: `<folder>/<frame id, six digits><extension>`.
struct FrameFiles {
  std::string folder;     ///< inside the result
  std::string extension;  ///< ".h5"
};

/// The interface that a stage's function works through: its inputs, its options, and the only ways
/// to write. The runner behind it does everything else (lock, staging folder, resume, sync,
/// digests, manifest).
class StageRun {
 public:
  virtual ~StageRun() = default;

  /// Path of the input of a kind named in the stage's row.
  virtual const std::filesystem::path& input(std::string_view kind) const = 0;

  /// Whether an input of this kind exists: always true, except for the row's optional inputs.
  virtual bool has_input(std::string_view kind) const = 0;

  /// Consent of everybody whom the inputs are of; empty: none is recorded.
  virtual std::vector<Consent> consent() const { return {}; }

  template <class Options>
  const Options& options() const {
    return *static_cast<const Options*>(option_values());
  }

  virtual Device device() const = 0;

  /// Writes the files of every frame. `write` is given a frame and the paths of empty temporary
  /// files to fill, in the order of `files`; the runner then syncs, digests and renames them, so
  /// that a killed run loses only the frames in progress: a frame is finished once all its files
  /// exist. Frames that an earlier run has finished are skipped, and so are those that --frames and
  /// --shard leave to other runs. `write` is called from up to --jobs threads at once. `frame_ids`
  /// must be increasing and not negative, and may be empty; `bytes_per_frame`, if known, is checked
  /// against the free space first. Sequences of meshes are written with output_sequences
  /// (core/store/output_sequences.h).
  ///
  /// Returns true if every frame is finished: the function continues with the files that join them.
  /// Returns false if frames are missing or the run was told to stop: the function has to return.
  virtual bool each_frame(
      const std::vector<FrameFiles>& files, const std::vector<int>& frame_ids,
      const std::function<void(int frame_id, std::span<const std::filesystem::path> files)>& write,
      std::int64_t bytes_per_frame) = 0;

  /// The same with one file for each frame.
  bool each_frame(const std::string& folder, const std::string& extension,
                  const std::vector<int>& frame_ids,
                  const std::function<void(int frame_id, const std::filesystem::path& file)>& write,
                  std::int64_t bytes_per_frame = 0) {
    return each_frame(
        {FrameFiles{folder, extension}}, frame_ids,
        [&](int frame_id, std::span<const std::filesystem::path> files) {
          write(frame_id, files.front());
        },
        bytes_per_frame);
  }

  /// Path of the finished file of a frame (the first, if there are several), once `each_frame` has
  /// returned true.
  virtual std::filesystem::path frame_file(int frame_id) const = 0;

  /// Writes one file of the result; `write` fills the temporary file that it is given.
  virtual void output(const std::string& path,
                      const std::function<void(const std::filesystem::path& file)>& write) = 0;

  /// Writes one text file of the result.
  virtual void output_text(const std::string& path, std::string_view text) = 0;

  /// A folder for unfinished work, such as a training's checkpoint. Its files survive a run that is
  /// stopped, fails or is killed, for the next run of the same request. It is not part of the
  /// result, and is removed when that is committed and, with --force, at the start.
  virtual std::filesystem::path scratch_folder() = 0;

  /// Records a number for the manifest and the report. Throws LogicError unless it is finite and
  /// the stage's row declares it.
  virtual void metric(const std::string& name, double value) = 0;

  /// Prints one line for the user.
  virtual void say(const std::string& line) = 0;

  /// A warning about the result: printed, and kept in the manifest for the report. Within
  /// `each_frame`, on the thread that was given the frame, it belongs to that frame, so that a
  /// resumed run keeps the warnings of frames finished earlier.
  virtual void warn(const std::string& line) = 0;

  /// Reports the progress of a stage without frames; `unit` names what is counted. Rate and time
  /// left are measured from the start of a count: its first call, which is best made before its
  /// work, a call with `done` not above that of the first, or one with another unit.
  /// @param figures  current values, by name, such as loss and PSNR
  virtual void progress(std::int64_t done, std::int64_t total, const std::string& unit,
                        const std::vector<std::pair<std::string, double>>& figures) = 0;
  void progress(std::int64_t done, std::int64_t total, const std::string& unit) {
    progress(done, total, unit, {});
  }

  /// True if the run was told to stop: the function should return soon; its output is removed.
  virtual bool stop_requested() = 0;

  /// Throws EnvironmentError unless the workspace's disk has that much free space.
  virtual void need_space(std::int64_t bytes) const = 0;

 protected:
  virtual const void* option_values() const = 0;
};

/// A number that a stage may record with `StageRun::metric`.
struct StageMetric {
  std::string_view name;
  std::string_view unit;      ///< "m", "px", "" for counts and shares
  bool input_errors = false;  ///< counts errors of the INPUT: above 0 it is not usable
};

/// One row of the table of stages.
struct Stage {
  std::string_view name;     ///< a verb or noun, also the command and the folder in the workspace
  int version = 1;           ///< raised whenever the same inputs and options give another result
  std::string_view summary;  ///< one line for --help
  std::array<std::string_view, 6> inputs{};  ///< kinds; one that no row makes is the user's INPUT
  /// Kinds of results of earlier stages that are read only if they exist.
  std::array<std::string_view, 6> optional_inputs{};
  std::array<std::string_view, 6> outputs{};  ///< kinds
  std::span<const StageMetric> metrics{};     ///< every number that it may record
  OptionSet (*options)() = nullptr;           ///< its defaults: option_set<ItsOptions>
  /// String options that may name a file, the content of which is part of the key.
  std::array<std::string_view, 6> file_options{};
  void (*run)(StageRun& run) = nullptr;  ///< read -> call -> write
  /// Throws DataError if an INPUT is of another kind, or one that options that are not keyed
  /// refuse; quick, since every plan calls it. Null: the INPUT is not checked before the run.
  void (*check_input)(const std::filesystem::path& input, const OptionTable& options) = nullptr;
  bool states_consent = false;  ///< its results contain the consent: a change of it recomputes them
  bool frame_wise = false;      ///< calls `each_frame`, so that it resumes and can be split
  bool has_cuda = false;        ///< has a CUDA twin: without one, --device cuda is refused
  bool device_keyed = false;    ///< its twins differ, so that --device is part of the key
};

/// Reports findings: warnings and errors with `warn`, notes with `say`.
/// @param whose  prefix of each line, such as "frame 3: "
void tell(StageRun& run, const std::vector<Finding>& findings, const std::string& whose = "");

/// The row of that name, or null.
const Stage* find_stage(std::span<const Stage> stages, std::string_view name);

/// The metric of that name; null if the stage has none (another version of it may have had one).
const StageMetric* find_metric(const Stage& stage, std::string_view name);

/// A metric as text, such as "0.0123 m". @param stage  that recorded it; null: without its unit
std::string metric_text(const Stage* stage, std::string_view name, double value);

/// The row of the stage that makes a kind, or null if none does.
const Stage* stage_that_makes(std::span<const Stage> stages, std::string_view kind);

}  // namespace atelier
