#include "core/seal/age_payload.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <sodium.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

static_assert(kAgeTag == crypto_aead_chacha20poly1305_ietf_ABYTES);
constexpr std::size_t kSealedChunk = kAgeChunk + kAgeTag;
constexpr std::size_t kBatchChunks = 32;
constexpr int kMostThreads = 4;

}  // namespace

std::array<std::uint8_t, 12> age_chunk_nonce(std::uint64_t number, bool last) {
  std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> nonce{};
  for (std::size_t i = 0; i < sizeof number; ++i) {
    nonce[10 - i] = static_cast<std::uint8_t>(number >> (8 * i));
  }
  nonce[11] = last ? 1 : 0;
  return nonce;
}

AgePayload::AgePayload(ByteSource source, Secret key, std::string file)
    : source_(std::move(source)), key_(std::move(key)), file_(std::move(file)) {}

AgePayload::~AgePayload() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

void AgePayload::take(Sealed& sealed, std::size_t chunks) {
  // One byte more tells the last chunk, which alone may be short.
  sealed.bytes.resize(chunks * kSealedChunk + 1);
  const std::size_t kept = has_ahead_ ? 1 : 0;
  sealed.bytes[0] = ahead_;
  const std::size_t got = kept + source_(std::span(sealed.bytes).subspan(kept));
  sealed.last = got < sealed.bytes.size();
  sealed.size = sealed.last ? got : got - 1;
  sealed.first_chunk = chunk_;
  ahead_ = sealed.bytes.back();
  has_ahead_ = !sealed.last;
  source_ended_ = sealed.last;
  chunk_ += chunks;
}

void AgePayload::open(const Sealed& sealed, Batch& batch) const {
  batch.size = 0;
  batch.last = false;
  std::size_t done = 0;
  std::uint64_t number = sealed.first_chunk;
  do {
    const std::size_t size = std::min(kSealedChunk, sealed.size - done);
    const std::string where = "chunk " + std::to_string(number);
    if (size < kAgeTag || (size == kAgeTag && number > 0)) {
      throw DataError(file_, where, "a file that was cut off", "all of the file");
    }
    const auto nonce = age_chunk_nonce(number, sealed.last && done + size == sealed.size);
    if (crypto_aead_chacha20poly1305_ietf_decrypt(batch.plain.data() + batch.size, nullptr, nullptr,
                                                  sealed.bytes.data() + done, size, nullptr, 0,
                                                  nonce.data(), key_.data()) != 0) {
      throw DataError(file_, where, "bytes that were changed or cut off",
                      "the file as it was sealed");
    }
    batch.size += size - kAgeTag;
    done += size;
    ++number;
  } while (done < sealed.size);
  batch.last = sealed.last;
}

/// Waits for the next part of the file; false where there is none for this thread.
bool AgePayload::take_turn(Sealed& sealed, std::uint64_t& turn) {
  const std::lock_guard reading(reading_);
  if (source_ended_) {
    return false;
  }
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopped_ || turn_ < current_ + kBatches; });
    if (stopped_) {
      return false;
    }
  }
  turn = turn_++;
  try {
    take(sealed, kBatchChunks);
  } catch (...) {
    source_ended_ = true;
    publish(turn, std::current_exception());
    return false;
  }
  return true;
}

void AgePayload::publish(std::uint64_t turn, std::exception_ptr error) {
  {
    const std::lock_guard lock(mutex_);
    batch_of(turn).error = std::move(error);
    batch_of(turn).ready = true;
  }
  changed_.notify_all();
}

void AgePayload::open_ahead() {
  Sealed sealed;
  std::uint64_t turn = 0;
  while (take_turn(sealed, turn)) {
    std::exception_ptr error;
    try {
      open(sealed, batch_of(turn));
    } catch (...) {
      error = std::current_exception();
    }
    publish(turn, std::move(error));
  }
}

void AgePayload::start_threads() {
  for (std::size_t i = 1; i < kBatches; ++i) {
    batches_.at(i).plain = Secret(kBatchChunks * kAgeChunk);
  }
  batches_[0].plain = Secret(kBatchChunks * kAgeChunk);
  const int count = std::clamp(thread_count(), 1, kMostThreads);
  try {
    for (int i = 0; i < count; ++i) {
      threads_.emplace_back([this] { open_ahead(); });
    }
  } catch (const std::system_error& error) {
    if (threads_.empty()) {
      throw EnvironmentError("threads", system_reason(error.code().value()));
    }
  }
}

/// Makes the next batch the one that is read. The first is one chunk, so that small files need
/// neither threads nor memory for them.
void AgePayload::advance() {
  if (!std::exchange(begun_, true)) {
    Sealed sealed;
    batches_[0].plain = Secret(kAgeChunk);
    take(sealed, 1);
    open(sealed, batches_[0]);
    turn_ = 1;
    return;
  }
  if (threads_.empty()) {
    start_threads();
  }
  std::unique_lock lock(mutex_);
  batch_of(current_).ready = false;
  ++current_;
  position_ = 0;
  changed_.notify_all();
  changed_.wait(lock, [&] { return batch_of(current_).ready; });
  if (batch_of(current_).error) {
    std::rethrow_exception(batch_of(current_).error);
  }
}

std::size_t AgePayload::read(std::span<std::uint8_t> buffer) {
  if (failed_) {
    std::rethrow_exception(failed_);
  }
  try {
    return read_on(buffer);
  } catch (...) {
    failed_ = std::current_exception();
    throw;
  }
}

std::size_t AgePayload::read_on(std::span<std::uint8_t> buffer) {
  std::size_t done = 0;
  while (done < buffer.size()) {
    const Batch& batch = batch_of(current_);
    if (position_ == batch.size) {
      if (begun_ && batch.last) {
        break;
      }
      advance();
      continue;
    }
    const std::size_t count = std::min(buffer.size() - done, batch.size - position_);
    std::copy_n(batch.plain.data() + position_, count,
                buffer.begin() + static_cast<std::ptrdiff_t>(done));
    position_ += count;
    done += count;
  }
  return done;
}

}  // namespace atelier
