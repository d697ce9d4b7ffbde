#pragma once

#include <cstddef>
#include <filesystem>

#include "core/regular_file.h"
#include "core/seal/age_stream.h"
#include "core/sha256.h"

namespace atelier {

/// Whether a file begins as sealed files do. False for what is no readable file.
bool is_sealed_file(const std::filesystem::path& path);

/// A sealed file, open for reading (AgeReader).
class SealedFile {
 public:
  /// Throws DataError, EnvironmentError.
  SealedFile(const std::filesystem::path& path, const AgeKeys& keys);

  std::size_t read(std::span<std::uint8_t> buffer) { return reader_.read(buffer); }

  /// The recipient whose key opened it (AgeReader::opened_by).
  const std::string& opened_by() const { return reader_.opened_by(); }
  /// SHA-256 of the file, once `read` has come to its end.
  Digest digest() const { return Sha256(hash_).finish(); }

 private:
  RegularFile file_;
  Sha256 hash_;
  AgeReader reader_;
};

/// The public part of a sealed file.
AgeHeader read_age_header(const std::filesystem::path& path);

}  // namespace atelier
