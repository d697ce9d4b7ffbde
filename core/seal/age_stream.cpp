#include "core/seal/age_stream.h"

#include <algorithm>
#include <array>
#include <utility>

#include <sodium.h>

#include "core/error.h"

namespace atelier {
namespace {

constexpr std::size_t kAgeChunk = std::size_t{64} << 10;
constexpr std::size_t kTag = crypto_aead_chacha20poly1305_ietf_ABYTES;
constexpr std::size_t kNonce = 16;
constexpr std::size_t kKeyBytes = 16;

/// Of one chunk: its number in 11 bytes, and 1 for the last.
std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> chunk_nonce(
    std::uint64_t number, bool last) {
  std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> nonce{};
  for (std::size_t i = 0; i < sizeof number; ++i) {
    nonce[10 - i] = static_cast<std::uint8_t>(number >> (8 * i));
  }
  nonce[11] = last ? 1 : 0;
  return nonce;
}

}  // namespace

AgeWriter::AgeWriter(const AgeRecipients& to, ByteSink sink)
    : sink_(std::move(sink)), chunk_(kAgeChunk), sealed_(kAgeChunk + kTag) {
  Secret file_key(kKeyBytes);
  randombytes_buf(file_key.data(), file_key.size());
  sink_(bytes_of(new_age_header(to, file_key)));
  std::array<std::uint8_t, kNonce> nonce{};
  randombytes_buf(nonce.data(), nonce.size());
  sink_(nonce);
  key_ = age_payload_key(file_key, nonce);
}

void AgeWriter::seal_chunk(bool last) {
  const auto nonce = chunk_nonce(counter_++, last);
  crypto_aead_chacha20poly1305_ietf_encrypt(sealed_.data(), nullptr, chunk_.data(), filled_,
                                            nullptr, 0, nullptr, nonce.data(), key_.data());
  sink_(Bytes(sealed_).first(filled_ + kTag));
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
    : source_(std::move(source)), file_(std::move(file)), plain_(kAgeChunk) {
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
  const Secret file_key = open_age_header(header_, keys, file_);
  std::array<std::uint8_t, kNonce> nonce{};
  if (take(nonce) < nonce.size()) {
    throw DataError(file_, "payload", "a file that ends before it", "all of the file");
  }
  key_ = age_payload_key(file_key, nonce);
}

std::size_t AgeReader::take(std::span<std::uint8_t> buffer) {
  const std::size_t kept = std::min(ahead_.size(), buffer.size());
  std::copy_n(ahead_.begin(), kept, buffer.begin());
  ahead_.erase(ahead_.begin(), ahead_.begin() + static_cast<std::ptrdiff_t>(kept));
  return kept < buffer.size() ? kept + source_(buffer.subspan(kept)) : kept;
}

void AgeReader::open_chunk() {
  // One byte more tells the last chunk, which alone may be short.
  std::vector<std::uint8_t> sealed(kAgeChunk + kTag + 1);
  const std::size_t got = take(sealed);
  const bool last = got < sealed.size();
  const std::size_t size = last ? got : got - 1;
  const std::string where = "chunk " + std::to_string(counter_);
  if (size < kTag || (size == kTag && counter_ > 0)) {
    throw DataError(file_, where, "a file that was cut off", "all of the file");
  }
  const auto nonce = chunk_nonce(counter_, last);
  if (crypto_aead_chacha20poly1305_ietf_decrypt(plain_.data(), nullptr, nullptr, sealed.data(),
                                                size, nullptr, 0, nonce.data(), key_.data()) != 0) {
    throw DataError(file_, where, "bytes that were changed or cut off",
                    "the file as it was sealed");
  }
  if (!last) {
    ahead_.insert(ahead_.begin(), sealed.back());
  }
  ++counter_;
  plain_size_ = size - kTag;
  position_ = 0;
  ended_ = last;
}

std::size_t AgeReader::read(std::span<std::uint8_t> buffer) {
  std::size_t done = 0;
  while (done < buffer.size()) {
    if (position_ == plain_size_) {
      if (ended_) {
        break;
      }
      open_chunk();
      continue;
    }
    const std::size_t count = std::min(buffer.size() - done, plain_size_ - position_);
    std::copy_n(plain_.data() + position_, count,
                buffer.begin() + static_cast<std::ptrdiff_t>(done));
    position_ += count;
    done += count;
  }
  return done;
}

}  // namespace atelier
