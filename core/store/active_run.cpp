#include "core/store/active_run.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <system_error>
#include <thread>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/store/commit.h"
#include "core/store/flag_command.h"
#include "core/store/frame_left_out.h"
#include "core/store/input_digest.h"
#include "core/store/manifest_limits.h"
#include "core/store/utc_time.h"
#include "core/store/write_text.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double seconds_since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string gigabytes(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g GB", bytes / 1e9);
  return text;
}

/// Peak resident memory, bytes, of this process or of the largest child that has ended.
std::int64_t peak_memory_bytes(int whose) {
  struct rusage usage {};
  getrusage(whose, &usage);
  return std::int64_t{usage.ru_maxrss} * 1024;
}

/// Begins this process's peak anew, at what it holds now: stages that run in one process have a
/// peak each. Where the system has no such file, it stays that of the whole process.
void forget_peak_memory() {
#ifdef __GLIBC__
  malloc_trim(0);  // what an earlier stage has freed is not this one's
#endif
  std::ofstream("/proc/self/clear_refs") << "5";
}

/// Of the frame that this thread works on, or null.
thread_local std::vector<std::string>* frame_warnings = nullptr;

}  // namespace

ActiveRun::ActiveRun(const Stage& stage, const StageRequest& request, const StagePlan& plan,
                     const StageEvents& events)
    : stage_(stage),
      request_(request),
      plan_(plan),
      events_(events),
      started_(seconds_since_1970()),
      earlier_children_(peak_memory_bytes(RUSAGE_CHILDREN)) {
  forget_peak_memory();
}

const std::filesystem::path& ActiveRun::input(std::string_view kind) const {
  for (std::size_t i = 0; i < plan_.manifest.inputs.size(); ++i) {
    if (plan_.manifest.inputs[i].kind == kind) {
      return plan_.input_paths[i];
    }
  }
  throw LogicError(std::string(stage_.name) + " has no input " + std::string(kind));
}

bool ActiveRun::has_input(std::string_view kind) const {
  return std::any_of(plan_.manifest.inputs.begin(), plan_.manifest.inputs.end(),
                     [&](const ManifestInput& input) { return input.kind == kind; });
}

bool ActiveRun::each_frame(const std::vector<FrameFiles>& files, const std::vector<int>& frame_ids,
                           const WriteFrame& write, std::int64_t bytes_per_frame) {
  ATELIER_CHECK(stage_.frame_wise, std::string(stage_.name) + " is not said to be frame-wise");
  ATELIER_CHECK(!asked_for_frames_, "each_frame is called once");
  ATELIER_CHECK(!files.empty(), "a frame has a file at least");
  asked_for_frames_ = true;
  if (frame_ids.empty()) {
    return begin_commit();  // every shard finds everything done
  }
  ATELIER_CHECK(frame_ids.front() >= 0 &&
                    std::adjacent_find(frame_ids.begin(), frame_ids.end(),
                                       [](int a, int b) { return a >= b; }) == frame_ids.end(),
                "frame numbers are increasing and not negative");
  require_named(files.size() * frame_ids.size());
  const Clock::time_point start = Clock::now();
  frames_total_ = static_cast<std::int64_t>(frame_ids.size());
  frame_files_ = frames_total_ * static_cast<std::int64_t>(files.size());
  const std::vector<int> mine =
      some_selected_frames(request_.selection, frame_ids,
                           plan_.input_paths.empty() ? "" : plan_.input_paths.front().string());
  if (mine.empty()) {
    say("there is nothing for this shard: " + to_string(request_.selection) + " of " +
        std::to_string(frame_ids.size()) + (frame_ids.size() == 1 ? " frame" : " frames"));
  }
  if (!open_frames(files, frame_ids, mine)) {
    frames_missing_ = true;
    return false;
  }
  std::vector<int> todo;
  std::copy_if(mine.begin(), mine.end(), std::back_inserter(todo),
               [&](int frame_id) { return !frames_.contains(frame_id); });
  if (todo.size() < mine.size()) {
    say(std::to_string(mine.size() - todo.size()) + " of " + std::to_string(mine.size()) +
        " frames are done already");
  }
  need_space(bytes_per_frame * static_cast<std::int64_t>(todo.size()));
  work(todo, static_cast<std::int64_t>(mine.size()), files, write);
  frame_loop_ = seconds_since(start);
  if (stopped_) {
    return false;
  }
  if (!begin_commit()) {
    return false;
  }
  for (auto& [frame_id, record] : logged_frames(files, frame_ids)) {
    frames_.try_emplace(frame_id, record);  // of other shards
  }
  frames_missing_ = std::any_of(frame_ids.begin(), frame_ids.end(),
                                [&](int frame_id) { return !frames_.contains(frame_id); });
  if (frames_missing_) {
    commit_lock_.reset();
  }
  return !frames_missing_;
}

bool ActiveRun::begin_commit() {
  commit_lock_ = FileLock::wait(plan_.stage_folder / ".commit-lock", FileLock::Mode::Exclusive);
  std::error_code error;
  frames_missing_ = !std::filesystem::is_directory(plan_.staging_folder, error);
  return !frames_missing_;
}

bool ActiveRun::open_frames(const std::vector<FrameFiles>& files, const std::vector<int>& frame_ids,
                            const std::vector<int>& mine) {
  const FileLock moment =
      FileLock::wait(plan_.stage_folder / ".commit-lock", FileLock::Mode::Exclusive);
  std::error_code error;
  if (!std::filesystem::is_directory(plan_.staging_folder, error)) {
    return false;
  }
  frame_lock_ = FrameLock::try_lock(plan_.staging_folder / ".frame-locks", mine);
  if (!frame_lock_) {
    throw EnvironmentError(plan_.stage_folder.string(),
                           "another run is working on some of these frames; wait until it ends, or "
                           "give each run a --shard i/n of its own");
  }
  frames_ = logged_frames(files, frame_ids);
  if (request_.force) {
    std::erase_if(frames_, [&](const auto& entry) {
      return std::binary_search(mine.begin(), mine.end(), entry.first);
    });
  }
  drop_damaged_frames();
  for (const FrameFiles& one : files) {
    make_private_directory(plan_.staging_folder / one.folder);
  }
  log_ = std::make_unique<FrameLog>(plan_.staging_folder);
  return true;
}

std::map<int, FrameRecord> ActiveRun::logged_frames(const std::vector<FrameFiles>& files,
                                                    const std::vector<int>& frame_ids) const {
  std::map<int, FrameRecord> frames = read_frame_logs(plan_.staging_folder);
  std::erase_if(frames, [&](const auto& entry) {
    const auto& [frame_id, record] = entry;
    if (!std::binary_search(frame_ids.begin(), frame_ids.end(), frame_id) ||
        record.beside.size() + 1 != files.size() ||
        record.output.path != frame_path(files.front(), frame_id)) {
      return true;
    }
    for (std::size_t i = 1; i < files.size(); ++i) {
      if (record.beside[i - 1].path != frame_path(files[i], frame_id)) {
        return true;
      }
    }
    return false;
  });
  return frames;
}

void ActiveRun::drop_damaged_frames() {
  const auto is_sound = [&](const ManifestOutput& output) {
    const std::filesystem::path path = plan_.staging_folder / output.path;
    struct stat status {};
    return lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
           status.st_size == output.size && digest_of_file(path).digest == output.digest;
  };
  std::vector<int> ids;
  for (const auto& entry : frames_) {
    ids.push_back(entry.first);
  }
  std::vector<char> sound(ids.size(), 0);
  parallel_for(static_cast<Index>(ids.size()), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const FrameRecord& record = frames_.at(ids[at]);
      sound[at] =
          record.left_out || (is_sound(record.output) &&
                              std::all_of(record.beside.begin(), record.beside.end(), is_sound));
    }
  });
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (sound[i] == 0) {
      say("frame " + std::to_string(ids[i]) + " of the interrupted run is damaged: done again");
      frames_.erase(ids[i]);
    }
  }
}

void ActiveRun::work(const std::vector<int>& todo, std::int64_t mine,
                     const std::vector<FrameFiles>& files, const WriteFrame& write) {
  frames_start_ = Clock::now();
  const std::int64_t before = mine - static_cast<std::int64_t>(todo.size());
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> ending = false;
  std::size_t failed = todo.size();  // the first that did, whichever thread had it
  std::exception_ptr failure;
  const auto worker = [&] {
    while (!ending) {
      if (stop_requested()) {
        return;
      }
      const std::size_t at = next++;
      if (at >= todo.size()) {
        return;
      }
      try {
        std::vector<std::string> paths;
        for (const FrameFiles& one : files) {
          paths.push_back(frame_path(one, todo[at]));
        }
        one_frame(todo[at], paths, write);
        const std::lock_guard lock(mutex_);
        ++frames_now_;
        const double rate =
            static_cast<double>(frames_now_) / std::max(seconds_since(frames_start_), 1e-9);
        const auto left = static_cast<double>(static_cast<std::int64_t>(todo.size()) - frames_now_);
        report_progress({"frames", before + frames_now_, mine, rate, left / rate});
      } catch (...) {  // carried to the thread that called; the rest is not begun
        const std::lock_guard lock(mutex_);
        if (at < failed) {
          failed = at;
          failure = std::current_exception();
        }
        ending = true;
      }
    }
  };
  const int jobs = request_.jobs > 0 ? request_.jobs : thread_count();
  const std::size_t threads =
      std::min(static_cast<std::size_t>(std::max(jobs, 1)), std::max<std::size_t>(todo.size(), 1));
  std::vector<std::jthread> pool;  // whatever happens here, they are waited for
  pool.reserve(threads);
  try {
    for (std::size_t i = 1; i < threads; ++i) {
      pool.emplace_back(worker);
    }
  } catch (const std::system_error& error) {
    ending = true;
    pool.clear();
    // With so little left no frame could be relied on either.
    throw EnvironmentError("threads", system_reason(error.code().value()));
  } catch (...) {
    ending = true;
    throw;
  }
  worker();
  pool.clear();
  if (failure) {
    std::rethrow_exception(failure);
  }
}

void ActiveRun::one_frame(int frame_id, const std::vector<std::string>& paths,
                          const WriteFrame& write) {
  const Clock::time_point start = Clock::now();
  FrameRecord record;
  record.frame_id = frame_id;
  try {
    record.beside = write_files(paths, [&](std::span<const std::filesystem::path> files) {
      frame_warnings = &record.warnings;
      try {
        write(frame_id, files);
      } catch (...) {
        frame_warnings = nullptr;
        throw;
      }
      frame_warnings = nullptr;
    });
  } catch (const FrameLeftOut&) {
    record.left_out = true;
    for (const std::string& path : paths) {
      std::error_code ignored;  // of a run that was killed before it had logged the frame
      std::filesystem::remove(plan_.staging_folder / path, ignored);
      record.beside.push_back({path, 0, {}});
    }
  }
  record.output = record.beside.front();
  record.beside.erase(record.beside.begin());
  record.seconds = seconds_since(start);
  record.peak_memory_bytes = peak_memory();
  const std::lock_guard lock(mutex_);
  log_->append(record);
  frames_[frame_id] = record;
}

std::vector<ManifestOutput> ActiveRun::write_files(
    const std::vector<std::string>& paths,
    const std::function<void(std::span<const std::filesystem::path>)>& write) {
  std::vector<std::unique_ptr<AtomicFile>> files;
  std::vector<std::filesystem::path> temporary;
  for (const std::string& path : paths) {
    files.push_back(std::make_unique<AtomicFile>(plan_.staging_folder / path));
    temporary.push_back(files.back()->temporary_path());
  }
  try {
    write(temporary);
  } catch (const EnvironmentError& error) {
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (error.place == temporary[i].string()) {  // the name that means something
        throw EnvironmentError((plan_.staging_folder / paths[i]).string(), error.reason);
      }
    }
    throw;
  }
  std::vector<ManifestOutput> outputs;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    // A library that writes by name may have made a new file with a mode of its own.
    std::error_code error;
    std::filesystem::permissions(
        temporary[i], std::filesystem::perms::owner_read | std::filesystem::perms::owner_write,
        error);
    if (error) {
      throw EnvironmentError((plan_.staging_folder / paths[i]).string(),
                             "cannot set its mode: " + system_reason(error.value()));
    }
    const FileDigest digest = digest_of_file(temporary[i]);
    outputs.push_back({paths[i], digest.size, digest.digest});
  }
  for (const std::unique_ptr<AtomicFile>& file : files) {
    file->commit();
  }
  return outputs;
}

std::filesystem::path ActiveRun::frame_file(int frame_id) const {
  const auto found = frames_.find(frame_id);
  ATELIER_CHECK(found != frames_.end(), "frame " + std::to_string(frame_id) + " is not finished");
  return plan_.staging_folder / found->second.output.path;
}

void ActiveRun::output(const std::string& path,
                       const std::function<void(const std::filesystem::path&)>& write) {
  ATELIER_CHECK(is_safe_output_path(path) && path != "manifest.json", "no output path: " + path);
  ATELIER_CHECK(!outputs_.contains(path), path + " is written twice");
  require_named(1);
  const std::filesystem::path full = plan_.staging_folder / path;
  make_private_directory(full.parent_path());
  outputs_[path] = write_files({path}, [&](std::span<const std::filesystem::path> files) {
                     write(files.front());
                   }).front();
}

void ActiveRun::require_named(std::size_t files) const {
  const std::int64_t all = frame_files_ + static_cast<std::int64_t>(outputs_.size() + files);
  if (all > kMaxFiles) {
    throw DataError(plan_.result_folder.string(), "",
                    "a result of " + std::to_string(all) + " files or more",
                    "at most " + std::to_string(kMaxFiles) + "; work on fewer frames");
  }
}

std::filesystem::path ActiveRun::scratch_folder() {
  std::filesystem::path folder = scratch_of(plan_.staging_folder);
  make_private_directory(folder);
  return folder;
}

void ActiveRun::output_text(const std::string& path, std::string_view text) {
  output(path, [&](const std::filesystem::path& file) { write_text(file, text); });
}

void ActiveRun::metric(const std::string& name, double value) {
  ATELIER_CHECK(std::isfinite(value), "metric " + name + " is not finite");
  ATELIER_CHECK(find_metric(stage_, name) != nullptr,
                std::string(stage_.name) + " declares no metric " + name);
  metrics_[name] = value;
}

void ActiveRun::say(const std::string& line) {
  if (events_.say) {
    const std::lock_guard lock(mutex_);  // frames may speak while others report progress
    events_.say(with_command(line, stage_.name, request_.options.table));
  }
}

void ActiveRun::warn(const std::string& line) {
  say(line);
  std::string told = printable(with_command(line, stage_.name, request_.options.table));
  if (frame_warnings != nullptr) {
    frame_warnings->push_back(std::move(told));
    return;
  }
  const std::lock_guard lock(mutex_);
  warnings_.push_back(std::move(told));
}

void ActiveRun::progress(std::int64_t done, std::int64_t total, const std::string& unit,
                         const std::vector<std::pair<std::string, double>>& figures) {
  const std::lock_guard lock(mutex_);
  if (unit != count_.unit || done <= count_.first) {
    count_ = {unit, done, Clock::now()};
  }
  const auto since = static_cast<double>(done - count_.first);
  const double rate = since / std::max(seconds_since(count_.start), 1e-9);
  if (frames_now_ == 0) {
    frames_start_ = Clock::now();  // what a stage counts in front of its frames is not their time
  }
  report_progress({unit, done, total, rate,
                   since > 0 ? static_cast<double>(total - done) / rate : 0.0, figures});
}

void ActiveRun::report_progress(const StageProgress& progress) {
  if (events_.progress) {
    events_.progress(progress);
  }
}

bool ActiveRun::stop_requested() {
  const std::lock_guard lock(mutex_);
  stopped_ = stopped_ || (events_.stop && events_.stop());
  return stopped_;
}

void ActiveRun::need_space(std::int64_t bytes) const {
  struct statvfs disk {};
  if (bytes <= 0 || statvfs(plan_.stage_folder.c_str(), &disk) != 0) {
    return;
  }
  const double free = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
  if (free < static_cast<double>(bytes)) {
    throw EnvironmentError(plan_.stage_folder.string(),
                           gigabytes(free) + " are free, the stage needs " +
                               gigabytes(static_cast<double>(bytes)) +
                               "; free some, or choose a workspace on another disk");
  }
}

std::int64_t ActiveRun::peak_memory() const {
  const std::int64_t own = peak_memory_bytes(RUSAGE_SELF);
  const std::int64_t children = peak_memory_bytes(RUSAGE_CHILDREN);
  return children > earlier_children_ ? std::max(own, children) : own;
}

Manifest ActiveRun::finished_manifest() const {
  Manifest manifest = plan_.manifest;
  std::map<std::string, ManifestOutput> sorted = outputs_;
  std::vector<std::string>& warnings = manifest.warnings = warnings_;
  manifest.peak_memory_bytes = peak_memory();
  manifest.work_seconds = seconds_since(start_) - frame_loop_;
  for (const auto& [frame_id, record] : frames_) {
    if (!record.left_out) {
      sorted[record.output.path] = record.output;
      for (const ManifestOutput& output : record.beside) {
        sorted[output.path] = output;
      }
    }
    warnings.insert(warnings.end(), record.warnings.begin(), record.warnings.end());
    manifest.work_seconds += record.seconds;
    manifest.peak_memory_bytes = std::max(manifest.peak_memory_bytes, record.peak_memory_bytes);
  }
  for (const auto& entry : sorted) {
    manifest.outputs.push_back(entry.second);
  }
  if (warnings.size() > kMaxWarnings) {
    const std::size_t more = warnings.size() - kMaxWarnings + 1;
    warnings.resize(kMaxWarnings - 1);
    warnings.push_back("and " + std::to_string(more) + " more");
  }
  manifest.metrics = metrics_;
  manifest.started = utc_text(started_);
  manifest.finished = utc_text(seconds_since_1970());
  return manifest;
}

std::string frame_path(const FrameFiles& files, int frame_id) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d", frame_id);
  return files.folder + "/" + name + files.extension;
}

}  // namespace atelier
