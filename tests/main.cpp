#include <gtest/gtest.h>

#include "tests/support/places.h"
#include "tests/support/temporary_root.h"

#ifndef ATELIER_PROGRAM
#define ATELIER_PROGRAM ""
#endif
#ifndef ATELIER_SMALL_PROGRAM
#define ATELIER_SMALL_PROGRAM ""
#endif

namespace atelier::fixtures {

std::filesystem::path source_directory() {
  return ATELIER_SOURCE_DIR;
}

std::string program_path() {
  return ATELIER_PROGRAM;
}

std::string small_program_path() {
  return ATELIER_SMALL_PROGRAM;
}

}  // namespace atelier::fixtures

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const atelier::fixtures::TemporaryRoot root;
  return RUN_ALL_TESTS();
}
