#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/seal/age_header.h"
#include "core/seal/age_payload.h"

namespace atelier {

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
  std::size_t read(std::span<std::uint8_t> buffer) { return payload_->read(buffer); }

  const AgeHeader& header() const { return header_; }
  /// The recipient whose key opened it, "age1...", or "a passphrase".
  const std::string& opened_by() const { return opened_by_; }

 private:
  std::size_t take(std::span<std::uint8_t> buffer);

  ByteSource source_;
  std::string file_;
  AgeHeader header_;
  std::string opened_by_;
  std::vector<std::uint8_t> ahead_;  ///< read with the header and not yet opened
  std::optional<AgePayload> payload_;
};

}  // namespace atelier
