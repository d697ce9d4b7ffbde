#pragma once

#include <cstddef>
#include <filesystem>

#include "core/regular_file.h"
#include "core/seal/age_stream.h"

namespace atelier {

/// Whether a file begins as sealed files do. False for what is no readable file.
bool is_sealed_file(const std::filesystem::path& path);

/// A sealed file, open for reading (AgeReader).
class SealedFile {
 public:
  /// Throws DataError, EnvironmentError.
  SealedFile(const std::filesystem::path& path, const AgeKeys& keys);

  std::size_t read(std::span<std::uint8_t> buffer) { return reader_.read(buffer); }

 private:
  RegularFile file_;
  AgeReader reader_;
};

/// What anybody can see of a sealed file.
AgeHeader read_age_header(const std::filesystem::path& path);

}  // namespace atelier
