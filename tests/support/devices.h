#pragma once

#include <gtest/gtest.h>

#include "core/device.h"

namespace atelier::fixtures {

/// A test body that runs once per device: `class Foo : public DeviceTest {};`, `TEST_P(Foo, ...)`
/// with `device()`, and ATELIER_ON_EVERY_DEVICE(Foo). CUDA is skipped where no device answers.
class DeviceTest : public ::testing::TestWithParam<Device> {
 protected:
  void SetUp() override {
    if (device() == Device::Cuda && !cuda_available()) {
      GTEST_SKIP() << "no CUDA device";
    }
  }
  static Device device() { return GetParam(); }
};

}  // namespace atelier::fixtures

#define ATELIER_ON_EVERY_DEVICE(suite)                                                   \
  INSTANTIATE_TEST_SUITE_P(Devices, suite, ::testing::Values(Device::Cpu, Device::Cuda), \
                           [](const auto& test) { return std::string(device_name(test.param)); })
