#pragma once

#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/support/places.h"

namespace atelier::fixtures {

/// Folder of real files: $ATELIER_TEST_DATA, or ../shared/data beside the source tree.
inline std::filesystem::path test_data_root() {
  const char* root = std::getenv("ATELIER_TEST_DATA");
  return root != nullptr ? std::filesystem::path(root) : source_directory() / "../shared/data";
}

}  // namespace atelier::fixtures

/// Path of a real test file; skips the test, saying so, where it is absent. Use in a test body:
///   ATELIER_TEST_FILE(path, "makehuman/base/base.obj");
#define ATELIER_TEST_FILE(variable, relative)                                                \
  const std::filesystem::path variable = ::atelier::fixtures::test_data_root() / (relative); \
  if (!std::filesystem::exists(variable)) {                                                  \
    GTEST_SKIP() << "no test data at " << variable << " (set ATELIER_TEST_DATA)";            \
  }
