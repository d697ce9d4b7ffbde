#pragma once

#include <cstddef>
#include <filesystem>

#include "core/regular_file.h"
#include "core/seal/age_stream.h"

namespace atelier {

/// Whether a file begins as sealed files do. False for what is no file; throws EnvironmentError for
/// one that may not be read.
bool is_sealed_file(const std::filesystem::path& path);

/// A sealed file, open for reading (AgeReader).
class SealedFile {
 public:
  /// Throws DataError, EnvironmentError.
  SealedFile(const std::filesystem::path& path, const AgeKeys& keys);

  std::size_t read(std::span<std::uint8_t> buffer) { return reader_.read(buffer); }

  /// The recipient whose key opened it (AgeReader::opened_by).
  const std::string& opened_by() const { return reader_.opened_by(); }
  /// Which file it is (age_header_digest).
  Digest digest() const { return age_header_digest(reader_.header()); }

 private:
  RegularFile file_;
  AgeReader reader_;
};

/// The public part of a sealed file.
AgeHeader read_age_header(const std::filesystem::path& path);

}  // namespace atelier
