#include <gtest/gtest.h>

#include "tests/support/temporary_root.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const atelier::testing::TemporaryRoot root;
  return RUN_ALL_TESTS();
}
