#include "core/late_library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string late_refusal(const char* library, const char* function) {
  try {
    late_symbol(library, function);
  } catch (const EnvironmentError& error) {
    return error.what();
  }
  return "";
}

TEST(LateLibrary, SystemFunction_IsFoundAndWorks) {
  const auto cosine = late_function<double(double)>("libm.so.6", "cos");
  EXPECT_EQ(cosine(0), 1);
  EXPECT_EQ(late_function<double(double)>("libm.so.6", "cos"), cosine);
}

TEST(LateLibrary, MissingLibraryOrFunction_IsNamed) {
  EXPECT_THAT(late_refusal("libatelier_nothing.so", "f"),
              AllOf(HasSubstr("libatelier_nothing.so"), HasSubstr("lib/atelier beside")));
  EXPECT_THAT(late_refusal("libm.so.6", "no_such_cosine"), HasSubstr("no_such_cosine"));
}

}  // namespace
}  // namespace atelier
