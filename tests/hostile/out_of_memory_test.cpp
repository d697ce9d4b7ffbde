// Memory that runs out at any place: operator new of this program fails when it is told to.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/hostile/readers.h"
#include "tests/hostile/sandbox.h"

namespace {

thread_local std::int64_t calls_left = 0;  // up to the one that fails; 0: none does
thread_local std::int64_t blocks = 0;      // that this thread has taken and not given back

}  // namespace

void* operator new(std::size_t size) {
  if (calls_left > 0 && --calls_left == 0) {
    throw std::bad_alloc();
  }
  void* memory = std::malloc(std::max<std::size_t>(size, 1));
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  ++blocks;
  return memory;
}

void operator delete(void* memory) noexcept {
  blocks -= memory != nullptr ? 1 : 0;
  std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}

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

void read_with_little(std::span<const std::byte> bytes) {
  const std::int64_t before = blocks;
  try {
    const Restored restored;
    calls_left = failing_call;
    reading(bytes);
  } catch (const std::bad_alloc&) {
    // As it may be.
  } catch (const DataError&) {
    // A library's own word for it.
  }
  ATELIER_CHECK(blocks == before, std::to_string(blocks - before) + " blocks are lost where call " +
                                      std::to_string(failing_call) + " fails");
}

class OutOfMemory : public ::testing::TestWithParam<Reader> {};

TEST_P(OutOfMemory, AnyAllocationMayFail) {
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
