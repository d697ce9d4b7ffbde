#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "core/seal/age_header.h"

namespace atelier {

/// Takes bytes on their way to a file.
using ByteSink = std::function<void(Bytes bytes)>;

/// Fills a buffer from a file: how many bytes it gave, fewer than asked for at the end alone.
using ByteSource = std::function<std::size_t(std::span<std::uint8_t> buffer)>;

/// Seals a stream of any size: header, nonce and a payload of chunks of 64 KiB (STREAM over
/// ChaCha20-Poly1305; age-encryption.org/v1, section "Payload"). Memory: two chunks.
class AgeWriter {
 public:
  /// Writes the header. Throws what `new_age_header` and the sink throw.
  AgeWriter(const AgeRecipients& to, ByteSink sink);

  void write(Bytes bytes);
  /// Writes the last chunk, without which nobody opens the file.
  void finish();

 private:
  void seal_chunk(bool last);

  ByteSink sink_;
  Secret key_;
  Secret chunk_;  ///< plain bytes that wait for the rest of their chunk
  std::size_t filled_ = 0;
  std::vector<std::uint8_t> sealed_;
  std::uint64_t counter_ = 0;
};

/// Opens a sealed stream. What `read` gives is authentic, and not yet whole: that it is all that
/// was sealed is known once `read` gives nothing more. So nothing may be kept before.
class AgeReader {
 public:
  /// Reads the header and finds the key. Throws DataError.
  /// @param file  for errors
  AgeReader(ByteSource source, const AgeKeys& keys, std::string file);

  /// Plain bytes; fewer than asked for at the end alone. Throws DataError where a bit was changed,
  /// where chunks are missing, double or in another order, and for bytes behind the end.
  std::size_t read(std::span<std::uint8_t> buffer);

  const AgeHeader& header() const { return header_; }

 private:
  std::size_t take(std::span<std::uint8_t> buffer);
  void open_chunk();

  ByteSource source_;
  std::string file_;
  AgeHeader header_;
  Secret key_;
  Secret plain_;
  std::size_t plain_size_ = 0;
  std::size_t position_ = 0;         ///< in `plain_`
  std::vector<std::uint8_t> ahead_;  ///< read from the source and not yet opened
  std::uint64_t counter_ = 0;
  bool ended_ = false;
};

}  // namespace atelier
