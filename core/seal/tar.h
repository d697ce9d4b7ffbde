#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/seal/age_stream.h"

namespace atelier {

/// One entry of an archive.
struct TarEntry {
  enum class Kind {
    File,
    Folder,
    Link,  ///< a stage's `current` alone: a name of 16 hexadecimal digits beside it
  };

  std::string path;  ///< relative, "a/b", without "." and ".." (`is_safe_tar_path`)
  Kind kind = Kind::File;
  std::int64_t size = 0;  ///< bytes of a file
  std::string target;     ///< of a link
};

/// True for paths that may stand in an archive: relative, printable UTF-8 of at most 1,024 bytes,
/// parts of 1 to 255 bytes between single "/", none of them "." or "..", at most 32 of them.
bool is_safe_tar_path(std::string_view path);

/// True for a link that may stand in an archive: one called `current` to 16 hexadecimal digits.
bool is_safe_tar_link(std::string_view path, std::string_view target);

/// Writes a tar archive (POSIX.1-1988 ustar; POSIX.1-2001 extended headers for long paths and files
/// of 8 GiB and more), which any tar reads. Owners, times and modes are not kept: they say nothing
/// to whoever gets it.
class TarWriter {
 public:
  explicit TarWriter(ByteSink sink);

  /// Begins an entry; of a file, exactly `size` bytes have to follow by `write`.
  void add(const TarEntry& entry);
  void write(Bytes bytes);
  /// Ends the archive, with zeros up to the next size of a coarse scale, so that its size says
  /// little: at most 12% more, 3% of a gigabyte (Padmé; Nikitin et al., PETS 2019, section 4).
  void finish();

  std::int64_t bytes() const { return written_; }

 private:
  void emit(Bytes bytes);
  void pad();

  ByteSink sink_;
  std::int64_t written_ = 0;
  std::int64_t left_ = 0;  ///< of the entry
};

/// A size of Padmé's scale, at least `size`.
std::int64_t padded_size(std::int64_t size);

/// Reads what TarWriter writes, and archives of other programs that have nothing but files, folders
/// and `current` links. Everything else is refused: other links, devices, unsafe paths, more than
/// 4 million entries, bytes behind the end. Paths that come twice are the caller's to refuse.
class TarReader {
 public:
  /// @param file  for errors
  TarReader(ByteSource source, std::string file);

  /// The next entry; nothing at the end, once all of the source has been read. What is left of the
  /// entry before is passed over. Throws DataError.
  std::optional<TarEntry> next();

  /// Bytes of the entry; fewer than asked for at its end alone. Throws DataError where the archive
  /// ends before it.
  std::size_t read(std::span<std::uint8_t> buffer);

 private:
  std::optional<TarEntry> parse(Bytes block);
  void read_extended(std::int64_t size);
  void skip(std::int64_t bytes);
  void read_block(std::span<std::uint8_t> block);
  void read_end();
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

  ByteSource source_;
  std::string file_;
  std::int64_t entries_ = 0;
  std::int64_t left_ = 0;     ///< of the entry
  std::int64_t padding_ = 0;  ///< behind it
  std::string long_path_;     ///< of an extended header, for the next entry
  std::optional<std::int64_t> large_size_;
  bool ended_ = false;
};

}  // namespace atelier
