#pragma once

#include <gtest/gtest.h>

#include "core/io/mesh_fbx.h"

/// Skips the test where FBX cannot be read.
#define ATELIER_NEEDS_FBX()                            \
  if (!atelier::reads_fbx()) {                         \
    GTEST_SKIP() << "this build is without libassimp"; \
  }
