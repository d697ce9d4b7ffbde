#include "core/seal/sealed_file.h"

#include <cerrno>

#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

std::size_t read_fully(int descriptor, const std::filesystem::path& path,
                       std::span<std::uint8_t> buffer) {
  std::size_t done = 0;
  while (done < buffer.size()) {
    const ssize_t got = read(descriptor, buffer.data() + done, buffer.size() - done);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0) {
      throw EnvironmentError(path.string(), "cannot read: " + system_reason(errno));
    }
    if (got == 0) {
      break;
    }
    done += static_cast<std::size_t>(got);
  }
  return done;
}

}  // namespace

bool is_sealed_file(const std::filesystem::path& path) {
  return begins_with(path, kAgeVersionLine);
}

SealedFile::SealedFile(const std::filesystem::path& path, const AgeKeys& keys)
    : file_(path),
      reader_(
          [this, path](std::span<std::uint8_t> buffer) {
            return read_fully(file_.descriptor(), path, buffer);
          },
          keys, path.string()) {}

AgeHeader read_age_header(const std::filesystem::path& path) {
  const RegularFile file(path);
  std::string start(kMaxAgeHeader, '\0');
  start.resize(read_fully(file.descriptor(), path,
                          {reinterpret_cast<std::uint8_t*>(start.data()), start.size()}));
  return parse_age_header(start, path.string());
}

}  // namespace atelier
