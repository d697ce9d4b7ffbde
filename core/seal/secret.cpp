#include "core/seal/secret.h"

#include <algorithm>
#include <cerrno>
#include <span>
#include <string>
#include <utility>

#include <sodium.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include "core/error.h"
#include "core/regular_file.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr std::size_t kMaxSecretFile = std::size_t{64} << 10;

}  // namespace

Bytes bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

void start_sodium() {
  if (sodium_init() < 0) {
    throw EnvironmentError("libsodium", "cannot be started");
  }
}

Secret::Secret(std::size_t size) : size_(size) {
  start_sodium();
  data_ = static_cast<std::uint8_t*>(sodium_malloc(size + 1));  // nothing is no memory to lock
  if (data_ == nullptr) {
    throw EnvironmentError("memory for keys", "there is not enough");
  }
  sodium_memzero(data_, size + 1);
}

Secret::Secret(Bytes bytes) : Secret(bytes.size()) {
  std::copy(bytes.begin(), bytes.end(), data_);
}

Secret::~Secret() {
  sodium_free(data_);
}

Secret::Secret(Secret&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

Secret& Secret::operator=(Secret&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

Secret read_secret_file(const std::filesystem::path& path) {
  const RegularFile file(path);
  file.check_size(static_cast<std::int64_t>(kMaxSecretFile), path);
  Secret secret(static_cast<std::size_t>(file.size()));
  const auto bytes = std::as_writable_bytes(std::span(secret.data(), secret.size()));
  if (file.read_on(bytes, path) < bytes.size()) {
    throw EnvironmentError(path.string(), "cannot read: " + system_reason(EIO));
  }
  return secret;
}

Secret read_passphrase(const std::filesystem::path& path) {
  const Secret file = read_secret_file(path);
  std::string_view line = file.text().substr(0, file.text().find('\n'));
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  if (line.empty()) {
    throw DataError(path.string(), "line 1", "nothing", "a passphrase");
  }
  return Secret(bytes_of(line));
}

void forbid_dumps() {
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  prctl(PR_SET_DUMPABLE, 0);
}

}  // namespace atelier
