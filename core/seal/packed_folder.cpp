#include "core/seal/packed_folder.h"

#include <algorithm>
#include <cerrno>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/regular_file.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = std::size_t{256} << 10;

bool stopped(const std::function<bool()>& stop) {
  return stop && stop();
}

/// One walk over a folder into an archive.
class Packer {
 public:
  Packer(TarWriter& archive, const std::function<bool()>& stop)
      : archive_(archive), stop_(stop), piece_(kPiece) {}

  void add_folder(const fs::path& folder, const std::string& inside) {
    for (const fs::path& path : list_folder(folder)) {
      const std::string name = path.filename().string();
      if (name.starts_with('.') || stopped(stop_)) {
        continue;
      }
      std::string entry = inside.empty() ? std::string() : inside + "/";
      entry += name;
      if (!is_safe_tar_path(entry)) {
        throw DataError(path.string(), "", "a name that an archive cannot hold",
                        "printable UTF-8 of at most 255 bytes");
      }
      switch (link_kind(path)) {
        case fs::file_type::directory:
          archive_.add({entry, TarEntry::Kind::Folder, 0, ""});
          add_folder(path, entry);
          break;
        case fs::file_type::regular:
          add_file(path, entry);
          break;
        case fs::file_type::symlink:
          add_link(path, entry);
          break;
        default:
          throw DataError(path.string(), "", "no file", "files and folders alone");
      }
    }
  }
  const PackedFolder& packed() const { return packed_; }

 private:
  void add_link(const fs::path& path, const std::string& entry) {
    const std::string target = fs::read_symlink(path).string();
    if (!is_safe_tar_link(entry, target)) {
      throw DataError(path.string(), "", "a link",
                      "files and folders: put what it leads to in its place");
    }
    archive_.add({entry, TarEntry::Kind::Link, 0, target});
  }

  void add_file(const fs::path& path, const std::string& entry) {
    const RegularFile file(path, O_NOFOLLOW);
    archive_.add({entry, TarEntry::Kind::File, file.size(), ""});
    std::int64_t left = file.size();
    while (left > 0) {
      const auto wanted = static_cast<std::size_t>(std::min(left, std::ssize(piece_)));
      const std::size_t got =
          file.read_on(std::as_writable_bytes(std::span(piece_).first(wanted)), path);
      if (got == 0) {
        throw DataError(path.string(), "", "a file that became shorter while it was read",
                        "one that nobody writes meanwhile");
      }
      archive_.write(Bytes(piece_).first(got));
      left -= static_cast<std::int64_t>(got);
    }
    ++packed_.files;
    packed_.bytes += file.size();
  }

  TarWriter& archive_;
  const std::function<bool()>& stop_;
  std::vector<std::uint8_t> piece_;
  PackedFolder packed_;
};

[[noreturn]] void fail(const fs::path& path, const std::string& action, int error) {
  throw EnvironmentError(path.string(), action + ": " + system_reason(error));
}

/// A new file, open for writing.
class NewFile {
 public:
  explicit NewFile(const fs::path& path)
      : path_(path),
        descriptor_(
            open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600)) {}
  ~NewFile() {
    if (descriptor_ >= 0) {
      close(descriptor_);
    }
  }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  void write(Bytes bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) {
        continue;
      }
      if (written < 0) {
        fail(path_, "cannot write", errno);
      }
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }
  void finish() {
    if (close(std::exchange(descriptor_, -1)) != 0) {
      fail(path_, "cannot close", errno);
    }
  }

 private:
  const fs::path& path_;
  int descriptor_;
};

[[noreturn]] void refuse_twice(const std::string& file, const TarEntry& entry) {
  throw DataError(file, entry.path.substr(0, 200), "a path that comes twice, or in a file", "once");
}

void unpack_file(TarReader& archive, const TarEntry& entry, const fs::path& path,
                 const std::string& archive_name, std::vector<std::uint8_t>& piece) {
  make_private_directory(path.parent_path());
  NewFile out(path);
  if (!out.is_open()) {
    if (errno == EEXIST || errno == ENOTDIR || errno == EISDIR) {
      refuse_twice(archive_name, entry);
    }
    fail(path, "cannot create it", errno);
  }
  for (std::size_t got = piece.size(); got == piece.size();) {
    got = archive.read(piece);
    out.write(Bytes(piece).first(got));
  }
  out.finish();
}

}  // namespace

PackedFolder pack_folder(const fs::path& folder, const FirstFile& first, const ByteSink& sink,
                         const std::function<bool()>& stop) {
  TarWriter archive(sink);
  archive.add({first.name, TarEntry::Kind::File, std::ssize(first.text), ""});
  archive.write(bytes_of(first.text));
  Packer packer(archive, stop);
  packer.add_folder(folder, "");
  archive.finish();
  return packer.packed();
}

std::string first_file(TarReader& archive, const std::string& name, const std::string& file) {
  constexpr std::int64_t kMaxFirst = std::int64_t{1} << 20;
  const auto entry = archive.next();
  if (!entry || entry->path != name || entry->kind != TarEntry::Kind::File ||
      entry->size > kMaxFirst) {
    throw DataError(file, "", "an archive that does not begin with " + name,
                    "what atelier seal packs");
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(entry->size));
  archive.read(bytes);
  return {bytes.begin(), bytes.end()};
}

PackedFolder unpack_folder(ByteSource source, const fs::path& folder, const std::string& file,
                           const std::function<bool()>& stop) {
  TarReader archive(std::move(source), file);
  std::vector<TarEntry> links;  // made last: nothing is written through one
  std::vector<std::uint8_t> piece(kPiece);
  PackedFolder packed;
  make_private_directory(folder);
  for (auto entry = archive.next(); entry && !stopped(stop); entry = archive.next()) {
    const fs::path path = folder / entry->path;
    switch (entry->kind) {
      case TarEntry::Kind::Folder:
        if (link_kind(path) != fs::file_type::directory &&
            link_kind(path) != fs::file_type::not_found) {
          refuse_twice(file, *entry);
        }
        make_private_directory(path);
        break;
      case TarEntry::Kind::Link:
        links.push_back(*entry);
        break;
      case TarEntry::Kind::File:
        unpack_file(archive, *entry, path, file, piece);
        ++packed.files;
        packed.bytes += entry->size;
        break;
    }
  }
  for (const TarEntry& link : links) {
    const fs::path path = folder / link.path;
    make_private_directory(path.parent_path());
    if (symlink(link.target.c_str(), path.c_str()) != 0) {
      if (errno == EEXIST) {
        refuse_twice(file, link);
      }
      fail(path, "cannot create it", errno);
    }
  }
  const int opened = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = opened >= 0 && syncfs(opened) == 0;
  const int error = errno;
  if (opened >= 0) {
    close(opened);
  }
  if (!synced) {
    fail(folder, "cannot sync", error);
  }
  return packed;
}

}  // namespace atelier
