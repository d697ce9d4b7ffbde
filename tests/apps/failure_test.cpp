#include "apps/console/failure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/console/device_advice.h"
#include "core/error.h"
#include "core/exit_code.h"
#ifdef ATELIER_HAS_CUDA
#include "core/cuda_check.h"
#endif

namespace atelier {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The words that a stage and `simulate` alone put behind it stay, and so does what to do.
TEST(FailureOf, ExhaustedDeviceMemory_SaysWhatToDo) {
#ifdef ATELIER_HAS_CUDA
  EXPECT_STREQ(kDeviceMemory, "CUDA device memory");
#endif
  for (const char* kept : {"", "; 2 finished frames are kept", "; frames before it are in out"}) {
    const EnvironmentError error("CUDA device memory",
                                 std::string("out of memory: 36.0 MB asked for, 1.0 MB free of "
                                             "80.0 MB") +
                                     kept);
    const Failure failure = failure_of(error);
    EXPECT_EQ(failure.exit_code, kExitEnvironment);
    EXPECT_EQ(failure.text,
              "CUDA device memory: " + error.reason +
                  "; use --device cpu, end other programs on the device, or take less "
                  "at a time: a coarser garment, smaller images");
    EXPECT_EQ(failure.found, "out of memory: 36.0 MB asked for, 1.0 MB free of 80.0 MB");
    EXPECT_THAT(failure.expected, HasSubstr("--device cpu"));
    EXPECT_EQ(failure.text.find('\n'), std::string::npos);
  }
}

TEST(FailureOf, FailingDevice_NamesTheFlagThatAvoidsIt) {
  EXPECT_THAT(with_device_advice({"CUDA", "no device answers"}), HasSubstr("; use --device cpu"));
  EXPECT_THAT(with_device_advice({"CUDA: launch of refit_kernel at cuda_body.cu:3",
                                  "cudaErrorIllegalAddress: an illegal memory access"}),
              HasSubstr("; use --device cpu"));
  EXPECT_THAT(with_device_advice({"CUDA", "no clusters; cuda_barrier auto does without"}),
              Not(HasSubstr("--device cpu")));
  EXPECT_THAT(with_device_advice({"/data/CUDA", "No space left"}), Not(HasSubstr("--device")));
}

}  // namespace
}  // namespace atelier
