#include "core/store/input_digest.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/regular_file.h"
#include "core/store/file_kind.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 20;
constexpr std::size_t kMostFiles = 4'000'000;  // 220 cameras of 18,000 frames

struct Entry {
  std::filesystem::path path;
  std::string name;  ///< relative, with "/"
};

std::vector<Entry> entries_of(const std::filesystem::path& root) {
  using std::filesystem::file_type;
  const file_type status = file_kind(root);
  if (status == file_type::regular) {
    return {{root, root.filename().string()}};
  }
  if (status == file_type::not_found) {
    throw DataError(root.string(), "", "nothing there", "an existing file or folder");
  }
  if (status != file_type::directory) {
    throw DataError(root.string(), "", "not a regular file", "a file or a folder");
  }
  std::vector<Entry> entries;
  std::error_code error;
  auto walk = std::filesystem::recursive_directory_iterator(root, error);
  if (error) {
    throw EnvironmentError(root.string(),
                           "cannot list the folder: " + system_reason(error.value()));
  }
  while (walk != std::filesystem::recursive_directory_iterator()) {
    const std::filesystem::path path = walk->path();
    const auto kind = walk->symlink_status(error);
    if (path.filename().string().starts_with(".")) {
      walk.disable_recursion_pending();
    } else if (std::filesystem::is_symlink(kind)) {
      throw DataError(path.string(), "", "a symbolic link, which may lead out of the folder",
                      "the file itself");
    } else if (std::filesystem::is_regular_file(kind)) {
      entries.push_back({path, path.lexically_relative(root).generic_string()});
    } else if (!std::filesystem::is_directory(kind)) {
      throw DataError(path.string(), "", "neither file nor folder", "files and folders alone");
    }
    if (entries.size() > kMostFiles) {
      throw DataError(root.string(), "", "more than " + std::to_string(kMostFiles) + " files",
                      "a smaller folder");
    }
    walk.increment(error);
    if (error) {
      throw EnvironmentError(path.string(),
                             "cannot list the folder: " + system_reason(error.value()));
    }
  }
  if (entries.empty()) {
    throw DataError(root.string(), "", "an empty folder", "files");
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.name < b.name; });
  return entries;
}

/// What the file system says of the files, without reading one.
struct Look {
  Digest stamp{};
  std::int64_t bytes = 0;
};

Look look_at(const std::vector<Entry>& entries) {
  Look look;
  Sha256 hash;
  for (const Entry& entry : entries) {
    struct stat status {};
    if (stat(entry.path.c_str(), &status) != 0) {
      const int error = errno;
      if (error == EACCES || error == EPERM) {
        throw EnvironmentError(entry.path.string(), "cannot look at it: " + system_reason(error));
      }
      throw DataError(entry.path.string(), "", std::generic_category().message(error),
                      "a readable file");
    }
    hash.update(entry.name + "\n" + std::to_string(status.st_size) + " " +
                std::to_string(status.st_mtim.tv_sec) + "." +
                std::to_string(status.st_mtim.tv_nsec) + "\n");
    look.bytes += status.st_size;
  }
  look.stamp = hash.finish();
  return look;
}

FileDigest read_digest(const std::filesystem::path& path, int flags, DigestMeter& meter) {
  const RegularFile file(path, flags);
  std::vector<char> chunk(kChunk);
  Sha256 hash;
  FileDigest result;
  while (true) {
    const ssize_t got = read(file.descriptor(), chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0) {
      throw EnvironmentError(path.string(), "cannot read: " + system_reason(errno));
    }
    if (got == 0) {
      break;
    }
    hash.update(chunk.data(), static_cast<std::size_t>(got));
    result.size += got;
    meter.add(got);
  }
  result.digest = hash.finish();
  return result;
}

}  // namespace

FileDigest digest_of_file(const std::filesystem::path& path, DigestMeter& meter) {
  return read_digest(path, O_NOFOLLOW, meter);
}

FileDigest digest_of_file(const std::filesystem::path& path) {
  DigestMeter nobody;
  return digest_of_file(path, nobody);
}

InputDigest digest_of_input(const std::filesystem::path& path, const StageEvents& events) {
  const std::vector<Entry> entries = entries_of(path);
  InputDigest result;
  const Look look = look_at(entries);
  result.stamp = look.stamp;
  DigestMeter meter(events);
  meter.expect(look.bytes);
  const bool single = entries.size() == 1 && entries[0].path == path;
  std::vector<FileDigest> digests(entries.size());
  parallel_for(static_cast<Index>(entries.size()), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end && !meter.stopped(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      digests[at] = read_digest(entries[at].path, single ? 0 : O_NOFOLLOW, meter);
    }
  });
  Sha256 hash;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    // A single file's name is no part of its content: renaming it redoes nothing.
    hash.update((single ? std::string("file") : entries[i].name) + "\n" +
                std::to_string(digests[i].size) + " " + hex(digests[i].digest) + "\n");
    result.bytes += digests[i].size;
  }
  result.files = static_cast<std::int64_t>(entries.size());
  result.digest = hash.finish();
  return result;
}

Digest stamp_of_input(const std::filesystem::path& path) {
  return look_at(entries_of(path)).stamp;
}

}  // namespace atelier
