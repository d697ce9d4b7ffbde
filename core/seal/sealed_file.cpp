#include "core/seal/sealed_file.h"

#include <array>
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
  try {
    const RegularFile file(path);
    std::array<std::uint8_t, kAgeVersionLine.size()> start{};
    return read_fully(file.descriptor(), path, start) == start.size() &&
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
            const std::size_t got = read_fully(file_.descriptor(), path, buffer);
            hash_.update(buffer.data(), got);
            return got;
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
