#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cuda_buffer.cuh"
#include "core/device.h"
#include "tests/support/device_memory.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

#define SKIP_WITHOUT_CUDA()           \
  if (!cuda_available()) {            \
    GTEST_SKIP() << "no CUDA device"; \
  }

template <class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const EnvironmentError& error) {
    return error.what();
  }
  return "nothing thrown";
}

__global__ void add_one(int* values, int n) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < n) {
    values[i] += 1;
  }
}

TEST(CudaBuffer, UploadKernelDownload_RoundTrips) {
  SKIP_WITHOUT_CUDA();
  std::vector<int> host(1000);
  std::iota(host.begin(), host.end(), 0);
  CudaBuffer<int> buffer(host);
  add_one<<<cuda_blocks(1000), kCudaBlock>>>(buffer.data(), 1000);
  ATELIER_CUDA_LAUNCHED(add_one);
  std::vector<int> expected(1000);
  std::iota(expected.begin(), expected.end(), 1);
  EXPECT_EQ(buffer.download(), expected);
  buffer.clear();
  EXPECT_EQ(buffer.download(), std::vector<int>(1000, 0));
}

TEST(CudaBuffer, MovedBuffer_KeepsItsData) {
  SKIP_WITHOUT_CUDA();
  CudaBuffer<double> a(std::vector<double>{1, 2, 3});
  CudaBuffer<double> b(std::move(a));
  EXPECT_EQ(b.download(), (std::vector<double>{1, 2, 3}));
  CudaBuffer<double> c(std::vector<double>{4});
  c = std::move(b);
  EXPECT_EQ(c.download(), (std::vector<double>{1, 2, 3}));
}

TEST(CudaBuffer, EmptyBuffer_IsNull) {
  const CudaBuffer<float> buffer;
  EXPECT_EQ(buffer.data(), nullptr);
  EXPECT_TRUE(buffer.download().empty());
}

TEST(CudaBuffer, UploadOfOtherSize_IsRefused) {
  CudaBuffer<int> buffer;
  ATELIER_EXPECT_REFUSED(buffer.upload(std::vector<int>{1}), LogicError, "another size");
}

TEST(CudaBuffer, OverflowingSize_IsRefused) {
  ATELIER_EXPECT_REFUSED(CudaBuffer<double>(std::numeric_limits<std::size_t>::max() / 2),
                         LogicError, "overflows");
}

TEST(CudaBuffer, OutOfMemory_SaysHowMuchWasAskedFor) {
  SKIP_WITHOUT_CUDA();
  const std::string message = message_of([] { CudaBuffer<char> buffer(std::size_t{1} << 50); });
  EXPECT_THAT(message, HasSubstr("out of memory"));
  EXPECT_THAT(message, HasSubstr("1125899906.8 MB asked for"));
}

// Without a device too, the words and what is given back.
TEST(CudaBuffer, FailedAllocation_GivesOneErrorAndLeaksNothing) {
  const int alive = fixtures::device_allocations_alive();
  {
    const fixtures::EndOfDeviceMemory end(0);
    const std::string message =
        message_of([] { const CudaBuffer<float> buffer(std::size_t{25'000'000}); });
    EXPECT_THAT(message, StartsWith("CUDA device memory: out of memory: 100.0 MB asked for"));
    EXPECT_EQ(fixtures::EndOfDeviceMemory::failed(), 1);
    EXPECT_THAT(message_of([] { const CudaBuffer<char> buffer(7); }), HasSubstr("7 bytes asked"));
  }
  EXPECT_EQ(fixtures::device_allocations_alive(), alive);
  EXPECT_THAT(message_of([] { const CudaBuffer<char> buffer; }), HasSubstr("nothing thrown"));
}

TEST(CudaBuffer, FailedAllocation_KeepsExistingBufferUsable) {
  SKIP_WITHOUT_CUDA();
  const std::vector<int> host{1, 2, 3};
  CudaBuffer<int> buffer(host);
  {
    const fixtures::EndOfDeviceMemory end(0);
    EXPECT_THAT(message_of([&] { buffer = CudaBuffer<int>(9); }), HasSubstr(" free of "));
  }
  EXPECT_EQ(cudaGetLastError(), cudaSuccess);
  EXPECT_EQ(buffer.download(), host);
  add_one<<<1, kCudaBlock>>>(buffer.data(), 3);
  ATELIER_CUDA_LAUNCHED(add_one);
  EXPECT_EQ(buffer.download(), (std::vector<int>{2, 3, 4}));
}

// A stream, a graph or code that is loaded when it first runs may be what does not fit.
TEST(CudaCheck, OutOfMemoryInAnyCall_GivesTheSameMessage) {
  try {
    check_cuda(cudaErrorMemoryAllocation, "cudaStreamCreate(&stream)", "some/file.cu", 42);
    FAIL() << "nothing thrown";
  } catch (const EnvironmentError& error) {
    EXPECT_EQ(error.place, kDeviceMemory);
    EXPECT_THAT(error.reason,
                StartsWith("out of memory: in cudaStreamCreate(&stream) at file.cu:42"));
  }
}

TEST(CudaCheck, ErrorMessage_NamesCallPlaceAndCode) {
  const std::string message =
      message_of([] { check_cuda(cudaErrorInvalidValue, "cudaMemcpy(a, b)", "some/file.cu", 42); });
  EXPECT_THAT(message, HasSubstr("cudaMemcpy(a, b)"));
  EXPECT_THAT(message, HasSubstr("file.cu:42"));
  EXPECT_THAT(message, HasSubstr("cudaErrorInvalidValue"));
  EXPECT_NO_THROW(check_cuda(cudaSuccess, "", "", 0));
}

TEST(CudaCheck, FailedLaunch_IsReported) {
  SKIP_WITHOUT_CUDA();
  const std::string message = message_of([] {
    add_one<<<1, 100000>>>(nullptr, 0);
    ATELIER_CUDA_LAUNCHED(add_one);
  });
  EXPECT_THAT(message, HasSubstr("launch of add_one"));
  EXPECT_NO_THROW(ATELIER_CUDA_CHECK(cudaGetLastError()));
}

}  // namespace
}  // namespace atelier
