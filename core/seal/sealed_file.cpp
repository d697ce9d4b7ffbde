#include "core/seal/sealed_file.h"

#include "core/error.h"

namespace atelier {
bool is_sealed_file(const std::filesystem::path& path) {
  return begins_with(path, kAgeVersionLine);
}

SealedFile::SealedFile(const std::filesystem::path& path, const AgeKeys& keys)
    : file_(path),
      reader_(
          [this, path](std::span<std::uint8_t> buffer) {
            return file_.read_on(std::as_writable_bytes(buffer), path);
          },
          keys, path.string()) {}

AgeHeader read_age_header(const std::filesystem::path& path) {
  const RegularFile file(path);
  std::string start(kMaxAgeHeader, '\0');
  start.resize(file.read_on(std::as_writable_bytes(std::span(start)), path));
  return parse_age_header(start, path.string());
}

}  // namespace atelier
