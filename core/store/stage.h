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

namespace atelier {

/// Where one file of each frame goes: `<folder>/<frame id, six digits><extension>`.
struct FrameFiles {
  std::string folder;     ///< inside the result
  std::string extension;  ///< ".h5"
};

/// What a stage's function gets: its inputs, its options, and the only ways to write. The runner
/// behind it does everything else (lock, staging, resume, sync, digests, manifest).
class StageRun {
 public:
  virtual ~StageRun() = default;

  /// Where the input of a kind named in the stage's row is.
  virtual const std::filesystem::path& input(std::string_view kind) const = 0;

  /// Whether an input of this kind is there: always, but for those that the row calls optional.
  virtual bool has_input(std::string_view kind) const = 0;

  template <class Options>
  const Options& options() const {
    return *static_cast<const Options*>(option_values());
  }

  virtual Device device() const = 0;

  /// Writes one file of each of these for each frame. `write` is given a frame and the paths of
  /// empty temporary files to fill, in the order of `files`; the runner then syncs, digests and
  /// renames them, so that a kill costs no more than the frames in work: a frame is finished once
  /// all its files are there. Frames that an earlier run has finished are not asked for again, nor
  /// those that --frames and --shard leave to others. `write` is called from up to --jobs threads
  /// at once. `frame_ids` must be increasing and not negative; none are fine, where an input has
  /// nothing for them; `bytes_per_frame`, if known, is checked against the free space first.
  /// Sequences of meshes are written with output_sequences (core/store/output_sequences.h).
  ///
  /// Returns true if now every frame is there, so that the function goes on to write what joins
  /// them; false if others are still to come or the run was told to stop: the function returns.
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

  /// Where the finished file of a frame is, of several the first, once `each_frame` has returned
  /// true.
  virtual std::filesystem::path frame_file(int frame_id) const = 0;

  /// Writes one file of the result; `write` fills the temporary file that it is given.
  virtual void output(const std::string& path,
                      const std::function<void(const std::filesystem::path& file)>& write) = 0;

  /// Writes one text file of the result.
  virtual void output_text(const std::string& path, std::string_view text) = 0;

  /// A folder for work that is not finished: what a run leaves there when it is stopped, fails or
  /// is killed, the next run of the same request finds again (a training's checkpoint). No part of
  /// the result; goes when that is committed, and with --force before it begins.
  virtual std::filesystem::path scratch_folder() = 0;

  /// A number for the manifest and the report. Throws LogicError unless it is finite and the
  /// stage's row declares it.
  virtual void metric(const std::string& name, double value) = 0;

  /// One line for whoever watches.
  virtual void say(const std::string& line) = 0;

  /// What is doubtful about the result: said, and kept in the manifest, which is where the report
  /// has it from. Within `each_frame`, on the thread that was given the frame, it is that frame's:
  /// a run that goes on has what the one before it was warned of.
  virtual void warn(const std::string& line) = 0;

  /// How far a stage without frames is; `unit` is what is counted. Rate and time left are those
  /// since a count began: at its first call, which is best made before its work, at a `done` not
  /// above that one's, or at another unit. So what came before is not taken for work of its kind.
  /// @param figures  how it goes, by name
  virtual void progress(std::int64_t done, std::int64_t total, const std::string& unit,
                        const std::vector<std::pair<std::string, double>>& figures) = 0;
  void progress(std::int64_t done, std::int64_t total, const std::string& unit) {
    progress(done, total, unit, {});
  }

  /// True if the run was told to stop: the function returns soon, and what it wrote is removed.
  virtual bool stop_requested() = 0;

  /// Throws EnvironmentError unless the workspace's disk has so much room.
  virtual void need_space(std::int64_t bytes) const = 0;

 protected:
  virtual const void* option_values() const = 0;
};

/// A number that a stage may give, by `StageRun::metric`.
struct StageMetric {
  std::string_view name;
  std::string_view unit;      ///< "m", "px", "" for counts and shares
  bool input_errors = false;  ///< counts what is wrong with the INPUT: above 0 it is no good
};

/// One row of the table of stages.
struct Stage {
  std::string_view name;     ///< a verb or noun, also the command and the folder in the workspace
  int version = 1;           ///< raised whenever the same inputs and options give another result
  std::string_view summary;  ///< one line for --help
  std::array<std::string_view, 6> inputs{};  ///< kinds; one that no row makes is the INPUT given
  /// Kinds that it can do without: results of earlier stages, read where they are.
  std::array<std::string_view, 6> optional_inputs{};
  std::array<std::string_view, 6> outputs{};  ///< kinds
  std::span<const StageMetric> metrics{};     ///< every number that it may give
  OptionSet (*options)() = nullptr;           ///< its defaults: option_set<ItsOptions>
  /// Options, strings, that may name a file: another content is another result.
  std::array<std::string_view, 6> file_options{};
  void (*run)(StageRun& run) = nullptr;  ///< read -> call -> write
  /// Throws DataError if an INPUT is of another kind; quick, since every plan asks it. Null: only
  /// the run finds out.
  void (*check_input)(const std::filesystem::path& input) = nullptr;
  bool states_consent = false;  ///< its results speak of consent: where that changes, they do
  bool frame_wise = false;      ///< calls `each_frame`, so that it resumes and can be split
  bool has_cuda = false;        ///< has a CUDA twin: without one, --device cuda is refused
  bool device_keyed = false;    ///< its twins differ, so that --device is part of the key
};

/// Warns of what is a warning or an error, says what is a note.
/// @param whose  what each line begins with: "frame 3: "
void tell(StageRun& run, const std::vector<Finding>& findings, const std::string& whose = "");

/// The row of that name, or null.
const Stage* find_stage(std::span<const Stage> stages, std::string_view name);

/// The metric of that name; null if the stage has none, which another version of it may have given.
const StageMetric* find_metric(const Stage& stage, std::string_view name);

/// "0.0123 m", for people. @param stage  that gave it; null: without its unit
std::string metric_text(const Stage* stage, std::string_view name, double value);

/// The row that makes a kind, or null if it comes from outside.
const Stage* stage_that_makes(std::span<const Stage> stages, std::string_view kind);

}  // namespace atelier
