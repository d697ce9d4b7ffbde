#include "core/store/input_digest.h"

#include <algorithm>
#include <cerrno>
#include <functional>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>

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

/// A file of an input.
struct InputFile {
  std::filesystem::path path;
  std::string name;  ///< relative, with "/"
};

using VisitFile = std::function<void(InputFile file)>;

/// Visits the files below a folder by their names; symbolic links are followed. An input has
/// millions of files: no more than the names in one folder are held at a time.
class FileWalk {
 public:
  FileWalk(const std::filesystem::path& root, const VisitFile& visit)
      : root_(root), visit_(visit) {}

  /// @param real  the same folder without links
  /// @param name  of the folder: "" or with "/" at its end
  void folder(const std::filesystem::path& folder, const std::filesystem::path& real,
              const std::string& name) {
    if (std::find(above_.begin(), above_.end(), real) != above_.end()) {
      throw DataError(folder.string(), "", "a symbolic link that leads in a circle",
                      "a link to a folder that does not contain it");
    }
    above_.push_back(real);
    for (std::string& entry : sorted_entries(folder)) {
      if (!entry.ends_with('/')) {
        file({folder / entry, name + entry});
        continue;
      }
      entry.pop_back();
      const std::filesystem::path inner = folder / entry;
      const bool link = link_kind(inner) == std::filesystem::file_type::symlink;
      this->folder(inner, link ? std::filesystem::canonical(inner) : real / entry,
                   name + entry + "/");
    }
    above_.pop_back();
  }

  std::int64_t files() const { return files_; }

 private:
  /// Folders with "/" at their end, so that whole names are in order.
  static std::vector<std::string> sorted_entries(const std::filesystem::path& folder) {
    std::vector<std::string> entries;
    std::error_code error;
    auto walk = std::filesystem::directory_iterator(folder, error);
    for (; !error && walk != std::filesystem::directory_iterator(); walk.increment(error)) {
      std::string entry = walk->path().filename().string();
      if (!entry.starts_with(".")) {
        const bool is_folder = file_kind(walk->path()) == std::filesystem::file_type::directory;
        entries.push_back(std::move(entry.append(is_folder ? "/" : "")));
      }
    }
    if (error) {
      throw EnvironmentError(folder.string(),
                             "cannot list the folder: " + system_reason(error.value()));
    }
    std::sort(entries.begin(), entries.end());
    return entries;
  }

  void file(InputFile found) {
    using std::filesystem::file_type;
    const file_type kind = file_kind(found.path);
    if (kind == file_type::not_found && link_kind(found.path) == file_type::symlink) {
      throw DataError(found.path.string(), "",
                      "a symbolic link to " + std::filesystem::read_symlink(found.path).string() +
                          ", where nothing is",
                      "a link to a file or folder that is there");
    }
    if (kind != file_type::regular) {
      throw DataError(found.path.string(), "", "neither file nor folder",
                      "files and folders alone");
    }
    if (found.name == kConsentFile) {  // consent is no content
      return;
    }
    if (++files_ > kMaxFiles) {
      throw DataError(root_.string(), "", "more than " + std::to_string(kMaxFiles) + " files",
                      "a smaller folder");
    }
    visit_(std::move(found));
  }

  const std::filesystem::path& root_;
  const VisitFile& visit_;
  std::vector<std::filesystem::path> above_;  ///< folders on the way to the current one
  std::int64_t files_ = 0;
};

/// Visits the file `root`, or every file below it.
void visit_files(const std::filesystem::path& root, const VisitFile& visit) {
  using std::filesystem::file_type;
  const file_type status = file_kind(root);
  if (status == file_type::regular) {
    visit({root, root.filename().string()});
    return;
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
  FileWalk walk(root, visit);
  walk.folder(root, real, "");
  if (walk.files() == 0) {
    throw DataError(root.string(), "", "an empty folder", "files");
  }
}

/// Sizes and times of the files, without reading one.
struct Look {
  Digest stamp{};
  std::int64_t bytes = 0;
};

Look look_at(const std::filesystem::path& root) {
  Look look;
  Sha256 hash;
  visit_files(root, [&](const InputFile& file) {
    struct stat status {};
    if (stat(file.path.c_str(), &status) != 0) {
      const int error = errno;
      if (error == EACCES || error == EPERM) {
        throw EnvironmentError(file.path.string(), "cannot look at it: " + system_reason(error));
      }
      throw DataError(file.path.string(), "", std::generic_category().message(error),
                      "a readable file");
    }
    hash.update(file.name + "\n" + std::to_string(status.st_size) + " " +
                std::to_string(status.st_mtim.tv_sec) + "." +
                std::to_string(status.st_mtim.tv_nsec) + "\n");
    look.bytes += status.st_size;
  });
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
    const std::size_t got = file.read_on(std::as_writable_bytes(std::span(chunk)), path);
    if (got == 0) {
      break;
    }
    hash.update(chunk.data(), got);
    result.size += static_cast<std::int64_t>(got);
    meter.add(static_cast<std::int64_t>(got));
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
  InputDigest result;
  const Look look = look_at(path);
  result.stamp = look.stamp;
  DigestMeter meter(events);
  meter.expect(look.bytes);
  const bool single = file_kind(path) == std::filesystem::file_type::regular;
  Sha256 hash;
  std::vector<InputFile> files;  // read together
  std::vector<std::uint64_t> sketched;
  const auto read_them = [&] {
    std::vector<FileDigest> digests(files.size());
    parallel_for(static_cast<Index>(files.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end && !meter.stopped(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        digests[at] = !single && files[at].name == "capture.toml"
                          ? digest_without_consent(files[at].path, meter)
                          : read_digest(files[at].path, 0, meter);
      }
    });
    for (std::size_t i = 0; i < files.size(); ++i) {
      // A single file's name is no part of its content: renaming it redoes nothing.
      hash.update((single ? std::string("file") : files[i].name) + "\n" +
                  std::to_string(digests[i].size) + " " + hex(digests[i].digest) + "\n");
      result.bytes += digests[i].size;
      if (!single) {
        sketched.push_back(leading_number(digests[i].digest));
      }
    }
    result.files += std::ssize(files);
    files.clear();
  };
  visit_files(path, [&](InputFile file) {
    constexpr std::size_t kTogether = 4096;
    files.push_back(std::move(file));
    if (files.size() == kTogether) {
      read_them();
    }
  });
  read_them();
  result.sketch = content_sketch(std::move(sketched));
  result.digest = hash.finish();
  if (consent == ConsentPart::Keyed) {
    result.digest = with_consent(result.digest, path);
    result.stamp = with_consent(result.stamp, path);
  }
  return result;
}

Digest stamp_of_input(const std::filesystem::path& path, ConsentPart consent) {
  const Digest stamp = look_at(path).stamp;
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
