#pragma once

#include <gmock/gmock.h>

/// Expects that a call throws `Error` and that its message has these words.
///   ATELIER_EXPECT_REFUSED(build_tree(vertices, faces), LogicError, "a vertex that is not there");
#define ATELIER_EXPECT_REFUSED(call, Error, words) \
  EXPECT_THAT([&] { static_cast<void>(call); },    \
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr(words)))
