#include "core/store/input_digest.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/parallel.h"
#include "core/regular_file.h"
#include "core/store/consent_file.h"
#include "core/store/manifest_limits.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 20;

struct Entry {
  std::filesystem::path path;
  std::string name;  ///< relative, with "/"
};

/// Gathers the files below a folder; symbolic links are followed.
class Gathering {
 public:
  explicit Gathering(const std::filesystem::path& root) : root_(root) {}

  /// @param real  the same folder without links
  void folder(const std::filesystem::path& folder, const std::filesystem::path& real) {
    if (std::find(above_.begin(), above_.end(), real) != above_.end()) {
      throw DataError(folder.string(), "", "a symbolic link that leads in a circle",
                      "a link to a folder that does not contain it");
    }
    above_.push_back(real);
    std::error_code error;
    auto walk = std::filesystem::directory_iterator(folder, error);
    for (; !error && walk != std::filesystem::directory_iterator(); walk.increment(error)) {
      if (!walk->path().filename().string().starts_with(".")) {
        add(walk->path(), real);
      }
    }
    if (error) {
      throw EnvironmentError(folder.string(),
                             "cannot list the folder: " + system_reason(error.value()));
    }
    above_.pop_back();
  }

  std::vector<Entry> sorted() {
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry& a, const Entry& b) { return a.name < b.name; });
    return std::move(entries_);
  }

 private:
  void add(const std::filesystem::path& path, const std::filesystem::path& real_folder) {
    using std::filesystem::file_type;
    const bool link = link_kind(path) == file_type::symlink;
    const file_type kind = file_kind(path);
    if (kind == file_type::directory) {
      folder(path, link ? std::filesystem::canonical(path) : real_folder / path.filename());
    } else if (kind == file_type::regular) {
      std::string name = path.lexically_relative(root_).generic_string();
      if (name != kConsentFile) {  // consent is no content
        entries_.push_back({path, std::move(name)});
      }
    } else if (link && kind == file_type::not_found) {
      throw DataError(path.string(), "",
                      "a symbolic link to " + std::filesystem::read_symlink(path).string() +
                          ", where nothing is",
                      "a link to a file or folder that is there");
    } else {
      throw DataError(path.string(), "", "neither file nor folder", "files and folders alone");
    }
    if (static_cast<std::int64_t>(entries_.size()) > kMaxFiles) {
      throw DataError(root_.string(), "", "more than " + std::to_string(kMaxFiles) + " files",
                      "a smaller folder");
    }
  }

  const std::filesystem::path& root_;
  std::vector<std::filesystem::path> above_;  ///< folders on the way to the current one
  std::vector<Entry> entries_;
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
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(root, error);
  if (error) {
    throw EnvironmentError(root.string(),
                           "cannot list the folder: " + system_reason(error.value()));
  }
  Gathering gathering(root);
  gathering.folder(root, real);
  std::vector<Entry> entries = gathering.sorted();
  if (entries.empty()) {
    throw DataError(root.string(), "", "an empty folder", "files");
  }
  return entries;
}

/// Sizes and times of the files, without reading one.
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

/// The bytes that count of a folder's own capture.toml.
FileDigest digest_without_consent(const std::filesystem::path& path, DigestMeter& meter) {
  const std::string text = read_file_text(path, Limits{}.text_file_bytes);
  meter.add(static_cast<std::int64_t>(text.size()));
  const std::string rest = without_consent(text);
  return {static_cast<std::int64_t>(rest.size()), sha256(rest)};
}

/// The number that a digest begins with.
std::uint64_t leading_number(const Digest& digest) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < sizeof number; ++i) {
    number = number << 8 | digest[i];
  }
  return number;
}

/// Consent stated inside of an input or beside it, joined to a digest of it.
Digest with_consent(const Digest& digest, const std::filesystem::path& path) {
  return sha256(hex(digest) + "\n" + consent_toml(read_consent(path)));
}

/// Kind of a line of TOML.
enum class LineKind { ConsentTable, OtherTable, Other };

LineKind kind_of_line(std::string_view line) {
  constexpr std::string_view kSpace = " \t\r\n";
  const auto trimmed = [&](std::string_view text) {
    const std::size_t begin = text.find_first_not_of(kSpace);
    return begin == std::string_view::npos
               ? std::string_view()
               : text.substr(begin, text.find_last_not_of(kSpace) + 1 - begin);
  };
  line = trimmed(line);
  if (!line.starts_with('[')) {
    return LineKind::Other;
  }
  line = trimmed(line.substr(0, line.find('#')));
  for (const auto& [open, close] : {std::pair("[[", "]]"), std::pair("[", "]")}) {
    if (line.starts_with(open)) {
      line.remove_prefix(std::string_view(open).size());
      return line.ends_with(close) &&
                     trimmed(line.substr(0, line.size() - std::string_view(close).size())) ==
                         "consent"
                 ? LineKind::ConsentTable
                 : LineKind::OtherTable;
    }
  }
  return LineKind::OtherTable;
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

InputDigest digest_of_input(const std::filesystem::path& path, const StageEvents& events,
                            ConsentPart consent) {
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
      digests[at] = !single && entries[at].name == "capture.toml"
                        ? digest_without_consent(entries[at].path, meter)
                        : read_digest(entries[at].path, 0, meter);
    }
  });
  Sha256 hash;
  std::vector<std::uint64_t> files;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    // A single file's name is no part of its content: renaming it redoes nothing.
    hash.update((single ? std::string("file") : entries[i].name) + "\n" +
                std::to_string(digests[i].size) + " " + hex(digests[i].digest) + "\n");
    result.bytes += digests[i].size;
    if (!single) {
      files.push_back(leading_number(digests[i].digest));
    }
  }
  result.sketch = content_sketch(std::move(files));
  result.files = static_cast<std::int64_t>(entries.size());
  result.digest = hash.finish();
  if (consent == ConsentPart::Keyed) {
    result.digest = with_consent(result.digest, path);
    result.stamp = with_consent(result.stamp, path);
  }
  return result;
}

Digest stamp_of_input(const std::filesystem::path& path, ConsentPart consent) {
  const Digest stamp = look_at(entries_of(path)).stamp;
  return consent == ConsentPart::Keyed ? with_consent(stamp, path) : stamp;
}

std::string without_consent(std::string_view toml) {
  if (toml.find("\"\"\"") != std::string_view::npos || toml.find("'''") != std::string_view::npos) {
    return std::string(toml);
  }
  std::string rest;
  bool skip = false;
  while (!toml.empty()) {
    const std::size_t end = toml.find('\n');
    const std::string_view line = toml.substr(0, end == std::string_view::npos ? end : end + 1);
    const LineKind kind = kind_of_line(line);
    if (kind == LineKind::ConsentTable || kind == LineKind::OtherTable) {
      skip = kind == LineKind::ConsentTable;
    }
    if (!skip) {
      rest += line;
    }
    toml.remove_prefix(line.size());
  }
  if (skip) {  // a table at the end came with the blank lines before it
    while (rest.ends_with("\n\n")) {
      rest.pop_back();
    }
  }
  return rest;
}

}  // namespace atelier
