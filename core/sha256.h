#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace atelier {

/// The 32 bytes of a SHA-256 hash.
using Digest = std::array<std::uint8_t, 32>;

/// SHA-256 (FIPS 180-4) of a stream of bytes. Uses the SHA instructions of x86 where the processor
/// has them, else plain C++; both give the same digest. Cost: one pass.
///
///   Sha256 hash;
///   hash.update(header.data(), header.size());
///   hash.update(body.data(), body.size());
///   const Digest digest = hash.finish();
class Sha256 {
 public:
  /// Which code hashes: what the processor can do best, or plain C++ (tests compare the two).
  enum class Code { Best, Scalar };

  explicit Sha256(Code code = Code::Best);

  /// Appends bytes. `data` may be null if `size` is 0. Throws LogicError after `finish`.
  void update(const void* data, std::size_t size);
  void update(std::string_view bytes) { update(bytes.data(), bytes.size()); }

  /// The digest of everything appended. Throws LogicError if called twice.
  Digest finish();

 private:
  using Compress = void (*)(std::uint32_t* state, const std::uint8_t* blocks, std::size_t count);

  Compress compress_;
  std::array<std::uint32_t, 8> state_;
  std::array<std::uint8_t, 64> block_;
  std::uint64_t size_ = 0;
  bool finished_ = false;
};

/// SHA-256 of bytes in memory.
Digest sha256(const void* data, std::size_t size);
Digest sha256(std::string_view bytes);

/// True if this processor has the SHA instructions, so that `Code::Best` uses them.
bool sha256_accelerated();

/// 64 lower-case hexadecimal digits.
std::string hex(const Digest& digest);

/// Reads what `hex` writes; nothing unless it is exactly 64 lower-case hexadecimal digits.
std::optional<Digest> digest_from_hex(std::string_view text);

}  // namespace atelier
