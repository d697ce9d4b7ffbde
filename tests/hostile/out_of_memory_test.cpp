// Memory that runs out at any place: operator new of this program fails when it is told to.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <new>
#include <string>
#include <string_view>

#include <dlfcn.h>
#include <execinfo.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/hostile/readers.h"
#include "tests/hostile/sandbox.h"

namespace {

// Of all threads: what one takes another may give back.
std::atomic<std::int64_t> calls_left = 0;  // up to the one that fails; 0 or less: none does
std::atomic<std::int64_t> blocks = 0;      // taken and not given back
std::atomic<bool> was_thrown = false;      // out of a form of new that throws

/// Calls in libraries that do not bear it. nlohmann::json takes memory where it is destroyed, which
/// ends the program, is half made where operator[] or push_back fail on a null, and loses what a
/// list in braces had begun; tinygltf has it inside. A folder that cannot be listed for want of
/// memory ends the program in libstdc++. Streams in toml++ and OpenCV's decoders swallow the
/// exception.
bool is_passed_over() {
  constexpr int kDepth = 40;
  std::array<void*, kDepth> frames{};
  const int count = backtrace(frames.data(), kDepth);
  const auto holds = [](const char* text, std::initializer_list<std::string_view> words) {
    return text != nullptr && std::any_of(words.begin(), words.end(), [&](std::string_view word) {
             return std::string_view(text).find(word) != std::string_view::npos;
           });
  };
  for (int i = 0; i < count; ++i) {
    Dl_info place{};
    if (dladdr(frames[static_cast<std::size_t>(i)], &place) != 0 &&
        (holds(place.dli_fname, {"libtomlplusplus", "libopencv", "libtinygltf"}) ||
         holds(place.dli_sname, {"directory_iterator"}) ||
         (holds(place.dli_sname, {"10basic_json"}) &&
          holds(place.dli_sname,
                {"7destroyE", "D1Ev", "D2Ev", "EEix", "9push_back", "ESt16initializer_list"})))) {
      return true;
    }
  }
  return false;
}

/// True for the call that is to fail, or the next one after it that can be borne.
bool fails() {
  if (calls_left.fetch_sub(1) != 1) {
    return false;
  }
  if (is_passed_over()) {
    calls_left = 1;
    return false;
  }
  return true;
}

void* block_of(std::size_t size, std::size_t alignment) {
  if (fails()) {
    return nullptr;
  }
  void* memory = nullptr;
  if (alignment <= alignof(std::max_align_t)) {
    memory = std::malloc(std::max<std::size_t>(size, 1));
  } else if (posix_memalign(&memory, alignment, std::max<std::size_t>(size, 1)) != 0) {
    return nullptr;
  }
  blocks += memory != nullptr ? 1 : 0;
  return memory;
}

void* block_or_throw(std::size_t size, std::size_t alignment) {
  void* memory = block_of(size, alignment);
  if (memory == nullptr) {
    was_thrown = true;
    throw std::bad_alloc();
  }
  return memory;
}

void give_back(void* memory) noexcept {
  blocks -= memory != nullptr ? 1 : 0;
  std::free(memory);
}

}  // namespace

// Every form: one left out would be the sanitizer's own, whose memory `free` may not be given.
// NOLINTBEGIN(cert-dcl54-cpp,misc-new-delete-overloads)
void* operator new(std::size_t size) {
  return block_or_throw(size, 1);
}
void* operator new[](std::size_t size) {
  return block_or_throw(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return block_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return block_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return block_of(size, 1);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return block_of(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return block_of(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return block_of(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  give_back(memory);
}
void operator delete[](void* memory) noexcept {
  give_back(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  give_back(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  give_back(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  give_back(memory);
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  give_back(memory);
}
void operator delete(void* memory, std::align_val_t, const std::nothrow_t&) noexcept {
  give_back(memory);
}
void operator delete[](void* memory, std::align_val_t, const std::nothrow_t&) noexcept {
  give_back(memory);
}
// NOLINTEND(cert-dcl54-cpp,misc-new-delete-overloads)

namespace atelier::fixtures {
namespace {

constexpr std::int64_t kMany = std::int64_t{1} << 60;

/// No call fails from the end of a scope on.
struct Restored {
  ~Restored() { calls_left = 0; }
};

/// What the sandbox calls: a reader with memory up to one call. Functions without a state are all
/// that a Reader takes.
void (*reading)(std::span<const std::byte>) = nullptr;
std::int64_t failing_call = 0;

/// What the reader did when its call failed, and how many blocks it lost; no memory of its own.
struct Outcome {
  std::int64_t lost = 0;
  char instead[400] = {};  // of std::bad_alloc; "": it was that, or nobody had to know
};

Outcome read_once(std::span<const std::byte> bytes) {
  Outcome outcome;
  const std::int64_t before = blocks;
  was_thrown = false;
  try {
    const Restored restored;
    calls_left = failing_call;
    reading(bytes);
    if (was_thrown) {
      std::snprintf(outcome.instead, sizeof outcome.instead, "went on as if nothing had been");
    }
  } catch (const std::bad_alloc&) {
    // As it is to be.
  } catch (const DataError& error) {
    if (was_thrown) {  // else a reader's process had no memory, and is refused as one that dies
      std::snprintf(outcome.instead, sizeof outcome.instead, "blamed the file: %s", error.what());
    }
  }
  outcome.lost = blocks - before;
  return outcome;
}

void read_with_little(std::span<const std::byte> bytes) {
  Outcome outcome = read_once(bytes);
  if (outcome.lost != 0) {  // what is made once and kept may be made where a call fails
    outcome = read_once(bytes);
  }
  const std::string place = "call " + std::to_string(failing_call) + " of operator new failed: ";
  ATELIER_CHECK(outcome.instead[0] == '\0', place + outcome.instead);
  ATELIER_CHECK(outcome.lost == 0, place + std::to_string(outcome.lost) + " blocks are lost");
}

class OutOfMemory : public ::testing::TestWithParam<Reader> {};

TEST_P(OutOfMemory, AnyFailedAllocation_IsSurvived) {
  const Bytes small = bytes_of(small_file_of(GetParam()));
  GetParam().read(small);  // what is made once is there
  calls_left = kMany;
  {
    const Restored restored;
    GetParam().read(small);
    failing_call = kMany - calls_left;
  }
  const auto calls = static_cast<std::size_t>(failing_call);
  ASSERT_GT(calls, 0U);
  const std::size_t tried = std::min(calls, places_of(GetParam()));
  reading = GetParam().read;
  EXPECT_EQ(read_all_in_sandbox({GetParam().name, read_with_little}, tried,
                                [&](std::size_t i) {
                                  failing_call = static_cast<std::int64_t>(1 + i * calls / tried);
                                  return small;
                                }),
            "");
}

INSTANTIATE_TEST_SUITE_P(Readers, OutOfMemory, ::testing::ValuesIn(all_readers()),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace atelier::fixtures
