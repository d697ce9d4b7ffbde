#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace atelier {

/// Bytes on their way through sealing: plain, sealed, or of a public key.
using Bytes = std::span<const std::uint8_t>;

/// Bytes of a text.
Bytes bytes_of(std::string_view text);

/// Memory for a key or a passphrase: locked (mlock), left out of core dumps (MADV_DONTDUMP),
/// between guard pages, and zeroed when it is freed. A limit on locked memory (ulimit -l) leaves it
/// unlocked.
class Secret {
 public:
  Secret() = default;
  /// Zeros. Throws EnvironmentError where there is no memory.
  explicit Secret(std::size_t size);
  explicit Secret(Bytes bytes);
  ~Secret();
  Secret(Secret&& other) noexcept;
  Secret& operator=(Secret&& other) noexcept;
  Secret(const Secret&) = delete;
  Secret& operator=(const Secret&) = delete;

  std::uint8_t* data() { return data_; }
  const std::uint8_t* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::span<std::uint8_t> writable() { return {data_, size_}; }
  Bytes bytes() const { return {data_, size_}; }
  std::string_view text() const { return {reinterpret_cast<const char*>(data_), size_}; }

 private:
  std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
};

/// A file of keys or a passphrase, whole. Throws DataError where it is missing or has more than
/// 64 KiB, EnvironmentError where it may not be read.
Secret read_secret_file(const std::filesystem::path& path);

/// The first line of a file, without its end: a passphrase. Throws as `read_secret_file`, and
/// DataError where the line is empty.
Secret read_passphrase(const std::filesystem::path& path);

/// No core dump of this process and its children from now on (RLIMIT_CORE), and no other process of
/// the same user may read its memory (PR_SET_DUMPABLE).
void forbid_dumps();

/// Starts libsodium; other functions of this folder do so themselves. Throws EnvironmentError.
void start_sodium();

}  // namespace atelier
