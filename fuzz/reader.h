#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/error.h"

/// One fuzz target per reader. fuzz/<reader>_fuzz.cpp holds
///
///   ATELIER_FUZZ_READER(npy) { parse_npy(bytes, "npy"); }
///
/// The body reads `bytes` (a std::span<const std::byte>) in memory and lets the DataError of a
/// refusal out. It may check invariants of what was read by ATELIER_CHECK: a LogicError, like any
/// other exception, crash, hang or more than 512 MB of memory, is a defect.
///
/// With libFuzzer (preset fuzz) this is a program of its own; in the ordinary tests tests/hostile
/// replays corpus, truncations, bit flips and mutations and expects words of refusals.
#ifdef ATELIER_LIBFUZZER
#define ATELIER_FUZZ_ENTRY(reader)                                                    \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) { \
    try {                                                                             \
      atelier::fuzz::fuzz_##reader(std::as_bytes(std::span(data, size)));             \
    } catch (const atelier::DataError&) {                                             \
    }                                                                                 \
    return 0;                                                                         \
  }
#else
#define ATELIER_FUZZ_ENTRY(reader)
#endif

#define ATELIER_FUZZ_READER(reader)                     \
  namespace atelier::fuzz {                             \
  void fuzz_##reader(std::span<const std::byte> bytes); \
  }                                                     \
  ATELIER_FUZZ_ENTRY(reader)                            \
  void atelier::fuzz::fuzz_##reader([[maybe_unused]] std::span<const std::byte> bytes)
