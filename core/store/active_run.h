#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/store/file_lock.h"
#include "core/store/frame_log.h"
#include "core/store/run_stage.h"

namespace atelier {

/// The StageRun behind `run_stage`: writes into the staging folder and keeps the account of it.
/// Internal to core/store.
class ActiveRun : public StageRun {
 public:
  using WriteFrame =
      std::function<void(int frame_id, std::span<const std::filesystem::path> files)>;

  ActiveRun(const Stage& stage, const StageRequest& request, const StagePlan& plan,
            const StageEvents& events);

  const std::filesystem::path& input(std::string_view kind) const override;
  bool has_input(std::string_view kind) const override;
  std::vector<Consent> consent() const override { return plan_.manifest.consent; }
  Device device() const override { return request_.device; }
  using StageRun::each_frame;
  bool each_frame(const std::vector<FrameFiles>& files, const std::vector<int>& frame_ids,
                  const WriteFrame& write, std::int64_t bytes_per_frame) override;
  std::filesystem::path frame_file(int frame_id) const override;
  void output(const std::string& path,
              const std::function<void(const std::filesystem::path& file)>& write) override;
  void output_text(const std::string& path, std::string_view text) override;
  std::filesystem::path scratch_folder() override;
  void metric(const std::string& name, double value) override;
  void say(const std::string& line) override;
  void warn(const std::string& line) override;
  using StageRun::progress;
  void progress(std::int64_t done, std::int64_t total, const std::string& unit,
                const std::vector<std::pair<std::string, double>>& figures) override;
  bool stop_requested() override;
  void need_space(std::int64_t bytes) const override;

  /// How `run` ended, as far as the staging folder goes.
  bool stopped() const { return stopped_; }
  bool frames_missing() const { return frames_missing_; }
  std::int64_t frames_done() const { return static_cast<std::int64_t>(frames_.size()); }
  std::int64_t frames_total() const { return frames_total_; }
  bool asked_for_frames() const { return asked_for_frames_; }

  /// The plan's manifest with outputs, metrics, warnings, times and memory filled in.
  Manifest finished_manifest() const;

 protected:
  const void* option_values() const override { return request_.options.values.get(); }

 private:
  /// Bytes, of this process since the run began, or of a child that needed more than any before.
  std::int64_t peak_memory() const;
  /// From here to the commit nobody else may decide that everything is done. False if another run
  /// has, and has committed: the frames are then said to be missing here.
  bool begin_commit();
  /// Under the commit lock: locks this run's frames and learns which are finished. False if the
  /// staging folder is gone, since another run has committed it.
  bool open_frames(const std::vector<FrameFiles>& files, const std::vector<int>& frame_ids,
                   const std::vector<int>& mine);
  /// The logs' entries of those of these frames that have all these files.
  std::map<int, FrameRecord> logged_frames(const std::vector<FrameFiles>& files,
                                           const std::vector<int>& frame_ids) const;
  void drop_damaged_frames();
  void work(const std::vector<int>& todo, std::int64_t mine, const std::vector<FrameFiles>& files,
            const WriteFrame& write);
  void one_frame(int frame_id, const std::vector<std::string>& paths, const WriteFrame& write);
  /// Writes files that are there together: all are filled before the first gets its name.
  std::vector<ManifestOutput> write_files(
      const std::vector<std::string>& paths,
      const std::function<void(std::span<const std::filesystem::path>)>& write);
  /// Refuses results of more files than a manifest may name, before they are made.
  void require_named(std::size_t files) const;
  void report_progress(const StageProgress& progress);

  /// The unit of `progress`, and when and at what count it began.
  struct Count {
    std::string unit;
    std::int64_t first = 0;
    std::chrono::steady_clock::time_point start;
  };

  const Stage& stage_;
  const StageRequest& request_;
  const StagePlan& plan_;
  const StageEvents& events_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double started_ = 0;     ///< seconds since 1970
  double frame_loop_ = 0;  ///< seconds spent in each_frame, whose frames count for themselves
  std::mutex mutex_;       ///< of everything below while threads work
  bool stopped_ = false;
  bool frames_missing_ = false;
  bool asked_for_frames_ = false;
  std::int64_t frames_total_ = 0;
  std::int64_t frame_files_ = 0;  ///< of all frames
  std::map<int, FrameRecord> frames_;
  std::unique_ptr<FrameLog> log_;
  std::optional<FrameLock> frame_lock_;
  std::optional<FileLock> commit_lock_;  ///< held from the last frame to the commit
  std::map<std::string, ManifestOutput> outputs_;
  std::map<std::string, double> metrics_;
  Count count_;
  /// When the frames of this run began to be counted.
  std::chrono::steady_clock::time_point frames_start_;
  std::int64_t frames_now_ = 0;        ///< finished by this run
  std::vector<std::string> warnings_;  ///< of no frame
  std::int64_t earlier_children_;      ///< bytes, the most that a child needed before this run
};

/// "statistics/000012.json".
std::string frame_path(const FrameFiles& files, int frame_id);

}  // namespace atelier
