#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/seal/byte_stream.h"

namespace atelier {

/// The chunks of a sealed file are of so many plain bytes, but for the last.
inline constexpr std::size_t kAgeChunk = std::size_t{64} << 10;

/// Bytes by which a chunk is longer once it is sealed.
inline constexpr std::size_t kAgeTag = 16;

/// Of one chunk: its number in 11 bytes, and 1 for the last.
std::array<std::uint8_t, 12> age_chunk_nonce(std::uint64_t number, bool last);

/// Opens the payload of a sealed file in order: chunk by chunk on the thread that reads, and where
/// there are many, some chunks ahead on threads of its own. Memory: 8 MiB and 2 MiB for each
/// thread.
class AgePayload {
 public:
  /// @param source  what stands behind the nonce; called by one thread at a time
  /// @param key  32 bytes
  /// @param file  for errors
  AgePayload(ByteSource source, Secret key, std::string file);
  ~AgePayload();
  AgePayload(const AgePayload&) = delete;
  AgePayload& operator=(const AgePayload&) = delete;

  /// Plain bytes; fewer than asked for at the end alone. Throws what AgeReader::read throws.
  std::size_t read(std::span<std::uint8_t> buffer);

 private:
  /// Chunks as they are in the file.
  struct Sealed {
    std::vector<std::uint8_t> bytes;
    std::size_t size = 0;
    std::uint64_t first_chunk = 0;
    bool last = false;
  };
  /// The same, opened.
  struct Batch {
    Secret plain;
    std::size_t size = 0;
    bool last = false;
    bool ready = false;
    std::exception_ptr error;
  };
  static constexpr std::size_t kBatches = 4;  ///< that are open at once

  void take(Sealed& sealed, std::size_t chunks);
  void open(const Sealed& sealed, Batch& batch) const;
  std::size_t read_on(std::span<std::uint8_t> buffer);
  void start_threads();
  void open_ahead();
  bool take_turn(Sealed& sealed, std::uint64_t& turn);
  void publish(std::uint64_t turn, std::exception_ptr error);
  void advance();
  Batch& batch_of(std::uint64_t turn) { return batches_.at(turn % kBatches); }

  ByteSource source_;
  Secret key_;
  std::string file_;
  std::array<Batch, kBatches> batches_;
  std::uint64_t current_ = 0;  ///< the turn of the batch that is read
  std::size_t position_ = 0;   ///< in it
  bool begun_ = false;
  std::exception_ptr failed_;  ///< what every read throws from now on

  std::mutex reading_;  ///< over the source and the next five
  std::uint64_t chunk_ = 0;
  std::uint64_t turn_ = 0;
  std::uint8_t ahead_ = 0;
  bool has_ahead_ = false;
  bool source_ended_ = false;

  std::mutex mutex_;  ///< over `current_`, `stopped_` and whether batches are ready
  std::condition_variable changed_;
  bool stopped_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace atelier
