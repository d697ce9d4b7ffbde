#include "core/seal/age_stream.h"

#include <algorithm>
#include <array>
#include <utility>

#include <sodium.h>

#include "core/error.h"

namespace atelier {
namespace {

constexpr std::size_t kNonce = 16;
constexpr std::size_t kKeyBytes = 16;

}  // namespace

AgeWriter::AgeWriter(const AgeRecipients& to, ByteSink sink)
    : sink_(std::move(sink)), chunk_(kAgeChunk), sealed_(kAgeChunk + kAgeTag) {
  Secret file_key(kKeyBytes);
  randombytes_buf(file_key.data(), file_key.size());
  sink_(bytes_of(new_age_header(to, file_key)));
  std::array<std::uint8_t, kNonce> nonce{};
  randombytes_buf(nonce.data(), nonce.size());
  sink_(nonce);
  key_ = age_payload_key(file_key, nonce);
}

void AgeWriter::seal_chunk(bool last) {
  const auto nonce = age_chunk_nonce(counter_++, last);
  crypto_aead_chacha20poly1305_ietf_encrypt(sealed_.data(), nullptr, chunk_.data(), filled_,
                                            nullptr, 0, nullptr, nonce.data(), key_.data());
  sink_(Bytes(sealed_).first(filled_ + kAgeTag));
  filled_ = 0;
}

void AgeWriter::write(Bytes bytes) {
  while (!bytes.empty()) {
    if (filled_ ==
        kAgeChunk) {  // only once more follows: the last chunk is full, or the only one empty
      seal_chunk(false);
    }
    const std::size_t count = std::min(bytes.size(), kAgeChunk - filled_);
    std::copy_n(bytes.begin(), count, chunk_.data() + filled_);
    filled_ += count;
    bytes = bytes.subspan(count);
  }
}

void AgeWriter::finish() {
  seal_chunk(true);
}

AgeReader::AgeReader(ByteSource source, const AgeKeys& keys, std::string file)
    : source_(std::move(source)), file_(std::move(file)) {
  std::string start;
  std::size_t end = 0;
  std::array<std::uint8_t, 4096> piece{};
  while (end == 0 && start.size() < kMaxAgeHeader) {
    const std::size_t got = source_(piece);
    start.append(piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(got));
    end = start.starts_with(kAgeVersionLine.substr(0, start.size())) ? age_header_size(start)
                                                                     : start.size();
    if (got < piece.size()) {
      break;
    }
  }
  header_ = parse_age_header(start, file_);
  ahead_.assign(start.begin() + static_cast<std::ptrdiff_t>(header_.size), start.end());
  const OpenedHeader opened = open_age_header(header_, keys, file_);
  opened_by_ = opened.by;
  std::array<std::uint8_t, kNonce> nonce{};
  if (take(nonce) < nonce.size()) {
    throw DataError(file_, "payload", "a file that ends before it", "all of the file");
  }
  payload_.emplace([this](std::span<std::uint8_t> buffer) { return take(buffer); },
                   age_payload_key(opened.file_key, nonce), file_);
}

std::size_t AgeReader::take(std::span<std::uint8_t> buffer) {
  const std::size_t kept = std::min(ahead_.size(), buffer.size());
  std::copy_n(ahead_.begin(), kept, buffer.begin());
  ahead_.erase(ahead_.begin(), ahead_.begin() + static_cast<std::ptrdiff_t>(kept));
  return kept < buffer.size() ? kept + source_(buffer.subspan(kept)) : kept;
}

}  // namespace atelier
