#include "pipeline/garment/kept_frames.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/plain_name.h"
#include "core/sequence_archive.h"
#include "core/store/file_lock.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Where one garment's frames are.
struct KeptGarment {
  StageRun& run;
  const std::string name;
  const std::vector<int>& frame_ids;

  int id(Index row) const { return frame_ids[static_cast<std::size_t>(row)]; }
  fs::path folder() const {
    fs::path folder = run.scratch_folder() / name;
    make_private_directory(folder);
    return folder;
  }
  fs::path file(Index row) const { return folder() / (frame_name(id(row)) + ".h5"); }
  /// The folder around the scratch is named by the key of all inputs and options.
  std::string made_of(Index row) const {
    return run.scratch_folder().parent_path().filename().string() + " " + name + " " +
           frame_name(id(row));
  }
};

std::optional<FollowedFrame> read_kept(const KeptGarment& kept, Index row,
                                       const RegistrationModel& model) {
  const fs::path file = kept.file(row);
  if (file_kind(file) == fs::file_type::not_found) {
    return std::nullopt;
  }
  try {
    return followed_frame_of(read_archive(file, kFollowedFrameSchema, 1), kept.made_of(row),
                             model.vertices.rows(), static_cast<Index>(model.samples.areas.size()),
                             file.string());
  } catch (const DataError& error) {
    kept.run.say(kept.name + ": frame " + std::to_string(kept.id(row)) +
                 " as it was kept is no good, and is followed again: " + error.what());
    std::error_code ignored;
    fs::remove(file, ignored);
    return std::nullopt;
  }
}

}  // namespace

FrameKeeping kept_frames(StageRun& run, const std::string& garment,
                         const std::vector<int>& frame_ids) {
  const KeptGarment kept{run, garment, frame_ids};
  FrameKeeping keeping;
  keeping.read = [kept](Index row, const RegistrationModel& model) {
    return read_kept(kept, row, model);
  };
  keeping.write = [kept](Index row, const FollowedFrame& frame) {
    write_archive(kept.file(row), archive_of(frame, kept.made_of(row)));
  };
  keeping.reserve = [kept](Index row) -> std::shared_ptr<void> {
    auto lock = FileLock::try_lock(kept.folder() / (frame_name(kept.id(row)) + ".lock"),
                                   FileLock::Mode::Exclusive);
    return lock ? std::make_shared<FileLock>(std::move(*lock)) : nullptr;
  };
  return keeping;
}

int kept_count(StageRun& run, const std::string& garment, const std::vector<int>& frame_ids) {
  const KeptGarment kept{run, garment, frame_ids};
  int count = 0;
  for (Index row = 0; row < std::ssize(frame_ids); ++row) {
    count += file_kind(kept.file(row)) != fs::file_type::not_found ? 1 : 0;
  }
  return count;
}

}  // namespace atelier
