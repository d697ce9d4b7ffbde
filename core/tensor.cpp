#include "core/tensor.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace atelier {
namespace {

struct TypeRow {
  ElementType type;
  const char* name;
  std::size_t bytes;
};

constexpr std::array<TypeRow, 16> kTypes = {{
    {ElementType::Bool, "bool", 1},
    {ElementType::Int8, "int8", 1},
    {ElementType::Int16, "int16", 2},
    {ElementType::Int32, "int32", 4},
    {ElementType::Int64, "int64", 8},
    {ElementType::UInt8, "uint8", 1},
    {ElementType::UInt16, "uint16", 2},
    {ElementType::UInt32, "uint32", 4},
    {ElementType::UInt64, "uint64", 8},
    {ElementType::Float16, "float16", 2},
    {ElementType::BFloat16, "bfloat16", 2},
    {ElementType::Float32, "float32", 4},
    {ElementType::Float64, "float64", 8},
    {ElementType::Complex64, "complex64", 8},
    {ElementType::Complex128, "complex128", 16},
    {ElementType::Text, "text", 0},
}};

const TypeRow& row_of(ElementType type) {
  return kTypes[static_cast<std::size_t>(type)];
}

template <class T>
T element(const Tensor& tensor, std::size_t i) {
  T value;
  std::memcpy(&value, tensor.data.data() + i * sizeof(T), sizeof(T));
  return value;
}

/// Calls `visit(T)` for each element of a real type, in the type's own representation; false for
/// Complex and Text.
template <class Visit>
bool visit_real(const Tensor& tensor, const Visit& visit) {
  const auto each = [&]<class T>(T) {
    const std::size_t count = tensor.data.size() / sizeof(T);
    for (std::size_t i = 0; i < count; ++i) {
      visit(i, element<T>(tensor, i));
    }
    return true;
  };
  const auto each_half = [&](float (*convert)(std::uint16_t)) {
    for (std::size_t i = 0; i < tensor.data.size() / 2; ++i) {
      visit(i, convert(element<std::uint16_t>(tensor, i)));
    }
    return true;
  };
  switch (tensor.type) {
    case ElementType::Bool:
    case ElementType::UInt8:
      return each(std::uint8_t{});
    case ElementType::Int8:
      return each(std::int8_t{});
    case ElementType::Int16:
      return each(std::int16_t{});
    case ElementType::Int32:
      return each(std::int32_t{});
    case ElementType::Int64:
      return each(std::int64_t{});
    case ElementType::UInt16:
      return each(std::uint16_t{});
    case ElementType::UInt32:
      return each(std::uint32_t{});
    case ElementType::UInt64:
      return each(std::uint64_t{});
    case ElementType::Float16:
      return each_half(float_from_half);
    case ElementType::BFloat16:
      return each_half(float_from_bfloat16);
    case ElementType::Float32:
      return each(float{});
    case ElementType::Float64:
      return each(double{});
    case ElementType::Complex64:
    case ElementType::Complex128:
    case ElementType::Text:
      break;
  }
  return false;
}

std::string index_text(const std::vector<std::int64_t>& shape, std::size_t flat) {
  std::vector<std::int64_t> index(shape.size());
  for (std::size_t d = shape.size(); d-- > 0;) {
    index[d] = static_cast<std::int64_t>(flat % static_cast<std::size_t>(shape[d]));
    flat /= static_cast<std::size_t>(shape[d]);
  }
  return shape_text(index);
}

}  // namespace

const char* element_type_name(ElementType type) {
  return row_of(type).name;
}

std::optional<ElementType> element_type_of(std::string_view name) {
  for (const TypeRow& row : kTypes) {
    if (name == row.name) {
      return row.type;
    }
  }
  return std::nullopt;
}

std::size_t element_bytes(ElementType type) {
  return row_of(type).bytes;
}

std::string shape_text(const std::vector<std::int64_t>& shape) {
  std::string text = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    text += (i > 0 ? "," : "") + std::to_string(shape[i]);
  }
  return text + "]";
}

std::optional<std::int64_t> element_count(const std::vector<std::int64_t>& shape,
                                          std::int64_t largest) {
  std::int64_t product = 1;
  bool empty = false;
  for (const std::int64_t size : shape) {
    if (size < 0) {
      return std::nullopt;
    }
    empty = empty || size == 0;
    const std::int64_t factor = std::max<std::int64_t>(size, 1);
    if (factor > largest / product) {
      return std::nullopt;
    }
    product *= factor;
  }
  return empty ? 0 : product;
}

std::int64_t element_count(const Tensor& tensor) {
  const auto count = element_count(tensor.shape, std::numeric_limits<std::int64_t>::max());
  ATELIER_CHECK(count.has_value(), "shape " + shape_text(tensor.shape));
  return *count;
}

void check_tensor(const Tensor& tensor) {
  const auto count = static_cast<std::size_t>(element_count(tensor));
  if (tensor.type == ElementType::Text) {
    ATELIER_CHECK(tensor.strings.size() == count && tensor.data.empty(),
                  "strings do not fit the shape " + shape_text(tensor.shape));
  } else {
    const std::size_t bytes = element_bytes(tensor.type);
    ATELIER_CHECK(tensor.data.size() % bytes == 0 && tensor.data.size() / bytes == count &&
                      tensor.strings.empty(),
                  "data do not fit the shape " + shape_text(tensor.shape));
  }
}

void check_finite(const Tensor& tensor, const std::string& file, const std::string& name) {
  const auto judge = [&](std::size_t i, auto value) {
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      if (!std::isfinite(value)) {
        throw DataError(file, name + index_text(tensor.shape, i), std::to_string(value),
                        "a finite number");
      }
    }
  };
  if (tensor.type == ElementType::Complex64 || tensor.type == ElementType::Complex128) {
    Tensor parts{
        tensor.type == ElementType::Complex64 ? ElementType::Float32 : ElementType::Float64,
        tensor.shape,
        tensor.data,
        {}};
    parts.shape.push_back(2);
    check_finite(parts, file, name);
    return;
  }
  visit_real(tensor, judge);
}

std::vector<double> doubles_of(const Tensor& tensor, const std::string& file,
                               const std::string& name) {
  check_tensor(tensor);
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(element_count(tensor)));
  if (!visit_real(tensor,
                  [&](std::size_t, auto value) { values.push_back(static_cast<double>(value)); })) {
    throw DataError(file, name, std::string("elements of type ") + element_type_name(tensor.type),
                    "real numbers");
  }
  return values;
}

std::vector<std::int64_t> integers_of(const Tensor& tensor, const std::string& file,
                                      const std::string& name) {
  check_tensor(tensor);
  std::vector<std::int64_t> values;
  const auto refuse = [&](const std::string& found) {
    throw DataError(file, name, found, "integers of at most 63 bits");
  };
  if (tensor.type >= ElementType::Float16) {
    refuse(std::string("elements of type ") + element_type_name(tensor.type));
  }
  values.reserve(static_cast<std::size_t>(element_count(tensor)));
  visit_real(tensor, [&](std::size_t i, auto value) {
    if constexpr (std::is_same_v<decltype(value), std::uint64_t>) {
      if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
        refuse(std::to_string(value) + " at " + index_text(tensor.shape, i));
      }
    }
    values.push_back(static_cast<std::int64_t>(value));
  });
  return values;
}

RowMatrix matrix_of(const Tensor& tensor, Index columns, const std::string& file,
                    const std::string& name) {
  if (tensor.shape.size() != 2 || (columns >= 0 && tensor.shape[1] != columns)) {
    throw DataError(file, name, "shape " + shape_text(tensor.shape),
                    "[rows," + (columns >= 0 ? std::to_string(columns) : "columns") + "]");
  }
  check_finite(tensor, file, name);
  const std::vector<double> values = doubles_of(tensor, file, name);
  return Eigen::Map<const RowMatrix>(values.data(), tensor.shape[0], tensor.shape[1]);
}

float float_from_half(std::uint16_t bits) {
  const std::uint32_t sign = static_cast<std::uint32_t>(bits & 0x8000u) << 16;
  const std::uint32_t exponent = (bits >> 10) & 0x1Fu;
  const std::uint32_t fraction = bits & 0x3FFu;
  if (exponent == 0) {  // zero or subnormal: fraction * 2^-24, exact in float
    const float magnitude = std::ldexp(static_cast<float>(fraction), -24);
    return sign != 0 ? -magnitude : magnitude;
  }
  if (exponent == 31) {
    return std::bit_cast<float>(sign | 0x7F800000u | (fraction << 13));
  }
  return std::bit_cast<float>(sign | ((exponent + 112) << 23) | (fraction << 13));
}

float float_from_bfloat16(std::uint16_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16);
}

}  // namespace atelier
