#include "core/tensor.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kTensorNan = std::numeric_limits<double>::quiet_NaN();

TEST(Tensor, VectorAndMatrix_RoundTrip) {
  const Tensor vector = tensor_of(std::vector<int>{1, 2, 3});
  EXPECT_EQ(vector.type, ElementType::Int32);
  EXPECT_THAT(vector.shape, ElementsAre(3));
  EXPECT_THAT(values_of<int>(vector), ElementsAre(1, 2, 3));

  Points points(2, 3);
  points << 1, 2, 3, 4, 5, 6;
  const Tensor matrix = tensor_of(points);
  EXPECT_THAT(matrix.shape, ElementsAre(2, 3));
  EXPECT_EQ(matrix_of(matrix, 3), points);
}

TEST(Tensor, ElementTypes_AreFoundByName) {
  for (int i = 0; i <= static_cast<int>(ElementType::Text); ++i) {
    const auto type = static_cast<ElementType>(i);
    EXPECT_EQ(element_type_of(element_type_name(type)), type);
  }
  EXPECT_FALSE(element_type_of("float128").has_value());
  EXPECT_EQ(element_type_for<std::uint64_t>(), ElementType::UInt64);
  EXPECT_EQ(element_type_for<std::int8_t>(), ElementType::Int8);
}

TEST(Tensor, OverflowingShape_HasNoElementCount) {
  constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(element_count({}, kLargest), 1);
  EXPECT_EQ(element_count({3, 4}, kLargest), 12);
  EXPECT_EQ(element_count({0, 4}, kLargest), 0);
  EXPECT_EQ(element_count({3, 4}, 11), std::nullopt);
  EXPECT_EQ(element_count({-1}, kLargest), std::nullopt);
  // Modulo 2^64 this product is 4.
  EXPECT_EQ(element_count({4194305, 4194305, 211106198978564}, kLargest), std::nullopt);
  EXPECT_EQ(element_count({0, 1LL << 62, 4}, kLargest), std::nullopt);
}

TEST(Tensor, DataSizeMismatch_ThrowsLogicError) {
  EXPECT_THROW(tensor_of(std::vector<int>{1, 2, 3}, {2, 2}), LogicError);
  Tensor tensor = tensor_of(std::vector<int>{1, 2, 3});
  tensor.data.pop_back();
  EXPECT_THROW(check_tensor(tensor), LogicError);
  EXPECT_THROW(values_of<float>(tensor_of(std::vector<int>{1})), LogicError);
}

TEST(Tensor, EveryRealType_ConvertsToDouble) {
  EXPECT_THAT(doubles_of(tensor_of(std::vector<std::uint64_t>{1, 1u << 31})),
              ElementsAre(1, 2147483648.0));
  EXPECT_THAT(doubles_of(tensor_of(std::vector<std::int8_t>{-1})), ElementsAre(-1));
  EXPECT_THAT(doubles_of(tensor_of(std::vector<float>{0.5f})), ElementsAre(0.5));
  Tensor half = tensor_of(std::vector<std::uint16_t>{0x3C00, 0xC000});
  half.type = ElementType::Float16;
  EXPECT_THAT(doubles_of(half), ElementsAre(1, -2));
  half.type = ElementType::BFloat16;
  EXPECT_EQ(doubles_of(half)[1], -2);
}

TEST(Tensor, HalfFloats_ConvertExactly) {
  EXPECT_EQ(float_from_half(0x0001), std::ldexp(1.0f, -24));
  EXPECT_EQ(float_from_half(0x03FF), std::ldexp(1023.0f, -24));
  EXPECT_EQ(float_from_half(0x7BFF), 65504.0f);
  EXPECT_EQ(float_from_half(0x8000), 0.0f);
  EXPECT_TRUE(std::signbit(float_from_half(0x8000)));
  EXPECT_TRUE(std::isinf(float_from_half(0xFC00)));
  EXPECT_TRUE(std::isnan(float_from_half(0x7E00)));
  EXPECT_EQ(float_from_bfloat16(0x4049), 3.140625f);
}

TEST(Tensor, FractionalOrHugeValues_AreNotIntegers) {
  EXPECT_THAT(integers_of(tensor_of(std::vector<std::uint32_t>{4294967295u})),
              ElementsAre(4294967295));
  EXPECT_THROW(integers_of(tensor_of(std::vector<double>{1.0})), DataError);
  EXPECT_THROW(integers_of(tensor_of(std::vector<std::uint64_t>{1ull << 63})), DataError);
}

TEST(Tensor, Text_IsNotANumber) {
  const Tensor text{ElementType::Text, {1}, {}, {"female"}};
  EXPECT_NO_THROW(check_tensor(text));
  EXPECT_THROW(doubles_of(text), DataError);
  EXPECT_THROW(integers_of(text), DataError);
}

TEST(Tensor, NonFiniteElement_IsFoundWithItsIndex) {
  const Tensor tensor = tensor_of(std::vector<double>{1, 2, 3, kTensorNan}, {2, 2});
  try {
    check_finite(tensor, "a.npz", "poses");
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.npz: poses[1,1]: nan"));
  }
  EXPECT_THROW(matrix_of(tensor), DataError);
  Tensor half = tensor_of(std::vector<std::uint16_t>{0x7C00});
  EXPECT_NO_THROW(check_finite(half, "", ""));
  half.type = ElementType::Float16;
  EXPECT_THROW(check_finite(half, "", ""), DataError);
  Tensor complex = tensor_of(std::vector<double>{0, kTensorNan}, {2});
  complex.type = ElementType::Complex128;
  complex.shape = {1};
  EXPECT_THROW(check_finite(complex, "", ""), DataError);
}

TEST(Tensor, WrongColumnCount_Throws) {
  const Tensor tensor = tensor_of(std::vector<float>{1, 2, 3, 4}, {2, 2});
  EXPECT_EQ(matrix_of(tensor).rows(), 2);
  EXPECT_THROW(matrix_of(tensor, 3), DataError);
  EXPECT_THROW(matrix_of(tensor_of(std::vector<float>{1})), DataError);
}

}  // namespace
}  // namespace atelier
