#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/types.h"

namespace atelier {

/// Type of the elements of a Tensor.
enum class ElementType {
  Bool,
  Int8,
  Int16,
  Int32,
  Int64,
  UInt8,
  UInt16,
  UInt32,
  UInt64,
  Float16,
  BFloat16,
  Float32,
  Float64,
  Complex64,
  Complex128,
  Text,
};

/// An array as files hold it (npy, safetensors, HDF5): numbers in the machine's byte order,
/// row-major.
struct Tensor {
  ElementType type = ElementType::Float64;
  std::vector<std::int64_t> shape;   ///< empty: a scalar
  std::vector<std::byte> data;       ///< numbers; empty for Text
  std::vector<std::string> strings;  ///< Text only, UTF-8
};

/// "bool", "int8" ... "float64", "complex128", "text".
const char* element_type_name(ElementType type);

/// The type of that name; nothing if there is none.
std::optional<ElementType> element_type_of(std::string_view name);

/// Bytes of one element; 0 for Text.
std::size_t element_bytes(ElementType type);

/// "[3,4]"; "[]" for a scalar.
std::string shape_text(const std::vector<std::int64_t>& shape);

/// Number of elements; nothing if a dimension is negative or the product, zeros counted as ones, is
/// larger than `largest`. With a zero counted as one, [0, 2^62] cannot smuggle a huge dimension in.
std::optional<std::int64_t> element_count(const std::vector<std::int64_t>& shape,
                                          std::int64_t largest);

/// Number of elements of a valid tensor.
std::int64_t element_count(const Tensor& tensor);

/// Throws LogicError unless data or strings have the size that shape and type say.
void check_tensor(const Tensor& tensor);

/// DataError unless every floating-point element is finite; names the first that is not.
void check_finite(const Tensor& tensor, const std::string& file, const std::string& name);

/// All elements of a real type (bool to float64) as double. DataError for Complex and Text.
/// @param file, name  for errors
std::vector<double> doubles_of(const Tensor& tensor, const std::string& file = "",
                               const std::string& name = "");

/// All elements of an integer type or bool. DataError for others and for values beyond int64.
std::vector<std::int64_t> integers_of(const Tensor& tensor, const std::string& file = "",
                                      const std::string& name = "");

/// A [R,C] tensor of a real type as a matrix; C < 0: any. DataError unless the shape is that and
/// every number is finite.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
RowMatrix matrix_of(const Tensor& tensor, Index columns = -1, const std::string& file = "",
                    const std::string& name = "");

/// IEEE half and bfloat16 to float, exactly.
float float_from_half(std::uint16_t bits);
float float_from_bfloat16(std::uint16_t bits);

/// The ElementType of a C++ number.
template <class T>
constexpr ElementType element_type_for() {
  if constexpr (std::is_same_v<T, bool>) {
    return ElementType::Bool;
  } else if constexpr (std::is_same_v<T, float>) {
    return ElementType::Float32;
  } else if constexpr (std::is_same_v<T, double>) {
    return ElementType::Float64;
  } else {
    static_assert(std::is_integral_v<T>, "a Tensor holds numbers");
    constexpr int kSize = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
    return static_cast<ElementType>(
        static_cast<int>(std::is_signed_v<T> ? ElementType::Int8 : ElementType::UInt8) + kSize);
  }
}

/// A tensor of numbers. Throws LogicError unless the shape has as many.
template <class T>
Tensor tensor_of(std::span<const T> values, std::vector<std::int64_t> shape) {
  Tensor tensor{element_type_for<T>(), std::move(shape), {}, {}};
  tensor.data.resize(values.size_bytes());
  if (!values.empty()) {
    std::memcpy(tensor.data.data(), values.data(), values.size_bytes());
  }
  check_tensor(tensor);
  return tensor;
}

/// A vector as a tensor, by default with one dimension.
template <class T>
Tensor tensor_of(const std::vector<T>& values) {
  return tensor_of(std::span<const T>(values), {static_cast<std::int64_t>(values.size())});
}
template <class T>
Tensor tensor_of(const std::vector<T>& values, std::vector<std::int64_t> shape) {
  return tensor_of(std::span<const T>(values), std::move(shape));
}

template <class T>
Tensor tensor_of(const Eigen::Matrix<T, Eigen::Dynamic, 1>& values) {
  return tensor_of(std::span<const T>(values.data(), static_cast<std::size_t>(values.size())),
                   {values.size()});
}

/// A row-major matrix as a [R,C] tensor of the same numbers.
template <class T, int Columns>
Tensor tensor_of(const Eigen::Matrix<T, Eigen::Dynamic, Columns, Eigen::RowMajor>& matrix) {
  return tensor_of(std::span<const T>(matrix.data(), static_cast<std::size_t>(matrix.size())),
                   {matrix.rows(), matrix.cols()});
}

/// The numbers, without a copy. Throws LogicError unless they are of this very type.
template <class T>
std::span<const T> values_of(const Tensor& tensor) {
  ATELIER_CHECK(tensor.type == element_type_for<T>(),
                std::string("a tensor of ") + element_type_name(tensor.type));
  check_tensor(tensor);
  return {reinterpret_cast<const T*>(tensor.data.data()), tensor.data.size() / sizeof(T)};
}

}  // namespace atelier
