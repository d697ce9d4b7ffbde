#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/store/manifest.h"

namespace atelier {

/// One finished frame of work that is not finished.
struct FrameRecord {
  int frame_id = 0;
  ManifestOutput output;
  std::vector<ManifestOutput> beside;  ///< its further files, where a frame has several
  double seconds = 0;                  ///< that the frame took
  std::int64_t peak_memory_bytes = 0;  ///< of the process, so far
  std::vector<std::string> warnings;   ///< that the frame gave cause for
  bool left_out = false;               ///< it has no files: core/store/frame_left_out.h
};

/// The list of finished frames that a run keeps in its staging folder: one line of JSON for each,
/// synced before the frame counts. Each run has a file of its own, so that shards share nothing; a
/// last line torn by a kill is ignored.
class FrameLog {
 public:
  /// Creates the run's own file. Throws EnvironmentError.
  explicit FrameLog(const std::filesystem::path& staging);
  ~FrameLog();
  FrameLog(const FrameLog&) = delete;
  FrameLog& operator=(const FrameLog&) = delete;

  /// Appends and syncs. Throws EnvironmentError; the log is then of no more use.
  void append(const FrameRecord& record);

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

/// Every finished frame that the logs of a staging folder name; lines that do not parse are left
/// out, so that at worst a frame is done again. Says nothing about the files: compare them.
std::map<int, FrameRecord> read_frame_logs(const std::filesystem::path& staging);

/// Those of one log's text, added to `records`.
void add_frame_records(std::string_view text, std::map<int, FrameRecord>& records);

/// True for the names of the logs.
bool is_frame_log_name(std::string_view file_name);

}  // namespace atelier
