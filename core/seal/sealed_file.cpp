#include "core/seal/sealed_file.h"

#include <array>

#include "core/error.h"

namespace atelier {
bool is_sealed_file(const std::filesystem::path& path) {
  try {
    const RegularFile file(path);
    std::array<std::uint8_t, kAgeVersionLine.size()> start{};
    return file.read_on(std::as_writable_bytes(std::span(start)), path) == start.size() &&
           std::string_view(reinterpret_cast<const char*>(start.data()), start.size()) ==
               kAgeVersionLine;
  } catch (const DataError&) {
    return false;
  } catch (const EnvironmentError&) {
    return false;
  }
}

SealedFile::SealedFile(const std::filesystem::path& path, const AgeKeys& keys)
    : file_(path),
      reader_(
          [this, path](std::span<std::uint8_t> buffer) {
            const std::size_t got = file_.read_on(std::as_writable_bytes(buffer), path);
            hash_.update(buffer.data(), got);
            return got;
          },
          keys, path.string()) {}

AgeHeader read_age_header(const std::filesystem::path& path) {
  const RegularFile file(path);
  std::string start(kMaxAgeHeader, '\0');
  start.resize(file.read_on(std::as_writable_bytes(std::span(start)), path));
  return parse_age_header(start, path.string());
}

}  // namespace atelier
