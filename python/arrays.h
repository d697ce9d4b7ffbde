#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "core/error.h"
#include "core/points_view.h"

namespace atelier::python {

namespace py = pybind11;

// NumPy in and out. A result is handed over with its memory; a field of a struct is seen in place,
// and what is assigned to it is copied into the struct. Arguments are of any layout, any type of
// number of the right kind, and no number that is not finite. Functions that take a PointsView see
// float64 [N,3] in order of rows in place; other arguments are copied once, since what takes them
// owns its numbers, or, of indices, since nobody may change them once they are checked.

/// "[N,3] numbers": what an argument has to be.
template <class Scalar, int Rows, int Columns>
std::string expected_array() {
  const auto size = [](int count) {
    return count == Eigen::Dynamic ? std::string("N") : std::to_string(count);
  };
  const std::string kind = std::is_integral_v<Scalar> ? " integers" : " finite numbers";
  if constexpr (Columns == 1) {
    return "[" + size(Rows) + "]" + kind;
  } else {
    return "[" + size(Rows) + "," + (Columns == Eigen::Dynamic ? "M" : size(Columns)) + "]" + kind;
  }
}

/// "float32 of shape (4, 2)".
std::string array_text(const py::array& array);

/// What was given as an array of numbers. Throws DataError for anything else, and for floating
/// numbers where whole ones are expected.
py::array number_array(py::handle given, bool whole, const std::string& expected);

/// Throws DataError at the first number that is not finite.
void require_finite(const double* values, Eigen::Index count, Eigen::Index columns);
void require_finite(const float* values, Eigen::Index count, Eigen::Index columns);

/// Copies an array of any layout into `target`, row by row.
template <class Scalar>
void copy_numbers(const py::array& from, Scalar* target, Eigen::Index count) {
  if constexpr (std::is_integral_v<Scalar>) {
    const bool same = from.dtype().kind() == (std::is_signed_v<Scalar> ? 'i' : 'u') &&
                      from.itemsize() == static_cast<py::ssize_t>(sizeof(Scalar));
    if (!same) {  // a number that does not fit is refused, not wrapped
      const auto wide =
          py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>::ensure(from);
      for (Eigen::Index i = 0; i < count; ++i) {
        const std::int64_t value = wide.data()[i];
        if (value < std::numeric_limits<Scalar>::min() ||
            value > std::numeric_limits<Scalar>::max()) {
          throw DataError("", "element " + std::to_string(i), std::to_string(value),
                          "an integer of " + std::to_string(8 * sizeof(Scalar)) + " bits");
        }
        target[i] = static_cast<Scalar>(value);
      }
      return;
    }
  }
  const auto plain = py::array_t<Scalar, py::array::c_style | py::array::forcecast>::ensure(from);
  std::copy(plain.data(), plain.data() + count, target);
}

/// A matrix of an array. Nothing and None are a matrix without rows, if it may have none.
template <class Matrix>
Matrix matrix_of(py::handle given) {
  using Scalar = typename Matrix::Scalar;
  constexpr int kRows = Matrix::RowsAtCompileTime;
  constexpr int kColumns = Matrix::ColsAtCompileTime;
  const std::string expected = expected_array<Scalar, kRows, kColumns>();
  if (kRows == Eigen::Dynamic && given.is_none()) {
    return Matrix(0, kColumns == Eigen::Dynamic ? 0 : kColumns);
  }
  const py::array array = number_array(given, std::is_integral_v<Scalar>, expected);
  if (kRows == Eigen::Dynamic && array.size() == 0 && array.ndim() == 1) {
    return Matrix(0, kColumns == Eigen::Dynamic ? 0 : kColumns);
  }
  const bool is_vector = kColumns == 1;
  const bool fits = array.ndim() == (is_vector ? 1 : 2) &&
                    (kRows == Eigen::Dynamic || array.shape(0) == kRows) &&
                    (is_vector || kColumns == Eigen::Dynamic || array.shape(1) == kColumns);
  if (!fits) {
    throw DataError("", "", array_text(array), expected);
  }
  using RowMajor =
      Eigen::Matrix<Scalar, kRows, kColumns, kColumns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
  RowMajor numbers(array.shape(0), is_vector ? 1 : array.shape(1));
  copy_numbers(array, numbers.data(), numbers.size());
  if constexpr (std::is_floating_point_v<Scalar>) {
    require_finite(numbers.data(), numbers.size(), std::max<Eigen::Index>(numbers.cols(), 1));
  }
  if constexpr (std::is_same_v<RowMajor, Matrix>) {
    return numbers;
  } else {
    return Matrix(numbers);
  }
}

/// The numbers of a matrix as an array over the same memory, which `owner` keeps alive.
template <class Matrix>
py::array array_over(const Matrix& matrix, py::handle owner) {
  using Scalar = typename Matrix::Scalar;
  constexpr py::ssize_t kSize = sizeof(Scalar);
  if constexpr (Matrix::ColsAtCompileTime == 1) {
    return py::array(py::dtype::of<Scalar>(), {matrix.size()}, {kSize}, matrix.data(), owner);
  } else {
    const py::ssize_t rows = Matrix::IsRowMajor ? matrix.cols() * kSize : kSize;
    const py::ssize_t columns = Matrix::IsRowMajor ? kSize : matrix.rows() * kSize;
    return py::array(py::dtype::of<Scalar>(), {matrix.rows(), matrix.cols()}, {rows, columns},
                     matrix.data(), owner);
  }
}

template <class Scalar>
py::array array_over(const std::vector<Scalar>& values, py::handle owner) {
  using Number = std::conditional_t<std::is_same_v<Scalar, char>, std::int8_t, Scalar>;
  return py::array(py::dtype::of<Number>(), {static_cast<py::ssize_t>(values.size())},
                   {static_cast<py::ssize_t>(sizeof(Scalar))},
                   reinterpret_cast<const Number*>(values.data()), owner);
}

/// An array in which nothing can be changed.
py::array read_only(py::array array);

/// Owner of something that arrays are over.
template <class Value>
py::capsule owner_of(Value&& value) {
  using Held = std::remove_cvref_t<Value>;
  auto held = std::make_unique<Held>(std::forward<Value>(value));
  py::capsule owner(held.get(), [](void* memory) { delete static_cast<Held*>(memory); });
  static_cast<void>(held.release());  // the capsule deletes it
  return owner;
}

/// An array that has taken over the memory of a result.
template <class Value>
py::array array_of(Value value) {
  const py::capsule owner = owner_of(std::move(value));
  return array_over(*owner.template get_pointer<Value>(), owner);
}

/// A struct's array as an attribute: read, it is an array over the struct's memory, in which
/// numbers can be changed; assigned, numbers are copied into it. Memory that an assignment of
/// another shape replaces stays as long as the struct does, for arrays that are over it.
template <auto Member, class Class>
void array_field(Class& type, const char* name, const char* doc = "") {
  using Struct = typename Class::type;
  using Field = std::remove_cvref_t<decltype(std::declval<Struct>().*Member)>;
  type.def_property(
      name,
      py::cpp_function(
          [](py::object self) { return array_over(self.cast<Struct&>().*Member, self); },
          py::return_value_policy::move),
      py::cpp_function([](py::object self, Field value) {
        Field& field = self.cast<Struct&>().*Member;
        bool same = false;
        if constexpr (requires { field.rows(); }) {
          same = field.rows() == value.rows() && field.cols() == value.cols();
        } else {
          same = field.size() == value.size();
        }
        if (same) {
          std::copy(value.data(), value.data() + value.size(), field.data());
        } else {
          py::detail::keep_alive_impl(self, owner_of(std::exchange(field, std::move(value))));
        }
      }),
      doc);
}

/// A vector of structs as an attribute: read, a list of copies, which stays sound whatever becomes
/// of the vector; assigned, it replaces the vector as a whole.
template <auto Member, class Class>
void list_field(Class& type, const char* name, const char* doc = "a copy: assign the whole list") {
  using Struct = typename Class::type;
  using Field = std::remove_cvref_t<decltype(std::declval<Struct>().*Member)>;
  type.def_property(
      name, [](const Struct& self) { return self.*Member; },
      [](Struct& self, Field value) { self.*Member = std::move(value); }, doc);
}

/// The same of a struct that does not change.
template <auto Member, class Class>
void list_of_copies(Class& type, const char* name, const char* doc = "copied") {
  using Struct = typename Class::type;
  type.def_property_readonly(
      name, [](const Struct& self) { return self.*Member; }, doc);
}

/// A struct in a struct as an attribute, seen in place. What an assignment replaces stays as long
/// as the outer struct does, since arrays may be over it.
template <auto Member, class Class>
void struct_field(Class& type, const char* name, const char* doc = "") {
  using Struct = typename Class::type;
  using Field = std::remove_cvref_t<decltype(std::declval<Struct>().*Member)>;
  type.def_property(name,
                    py::cpp_function([](Struct& self) -> Field& { return self.*Member; },
                                     py::return_value_policy::reference_internal),
                    py::cpp_function([](py::object self, Field value) {
                      py::detail::keep_alive_impl(
                          self,
                          owner_of(std::exchange(self.cast<Struct&>().*Member, std::move(value))));
                    }),
                    doc);
}

}  // namespace atelier::python

namespace pybind11::detail {

template <class Scalar, int Rows, int Columns, int Options, int MaxRows, int MaxColumns>
struct type_caster<Eigen::Matrix<Scalar, Rows, Columns, Options, MaxRows, MaxColumns>> {
  using Matrix = Eigen::Matrix<Scalar, Rows, Columns, Options, MaxRows, MaxColumns>;
  PYBIND11_TYPE_CASTER(Matrix, const_name("numpy.ndarray"));

  bool load(handle given, bool /*convert*/) {
    value = atelier::python::matrix_of<Matrix>(given);
    return true;
  }
  static handle cast(Matrix matrix, return_value_policy /*policy*/, handle /*parent*/) {
    return atelier::python::array_of(std::move(matrix)).release();
  }
};

/// Points in the memory of an array where it has their layout, else in a copy. Either is kept for
/// the length of the call.
template <>
struct type_caster<atelier::PointsView> {
  static constexpr auto name = const_name("numpy.ndarray");
  template <class T>
  using cast_op_type = atelier::PointsView;

  bool load(handle given, bool /*convert*/) {
    using Plain = array_t<double, array::c_style>;
    if (Plain::check_(given)) {
      const auto plain = reinterpret_borrow<Plain>(given);
      const bool aligned = (plain.flags() & npy_api::NPY_ARRAY_ALIGNED_) != 0;
      if (aligned && plain.ndim() == 2 && plain.shape(1) == 3) {
        atelier::python::require_finite(plain.data(), plain.size(), 3);
        seen_ = plain;
        data_ = plain.data();
        rows_ = plain.shape(0);
        return true;
      }
    }
    copy_ = atelier::python::matrix_of<atelier::Points>(given);
    data_ = copy_.data();
    rows_ = copy_.rows();
    return true;
  }
  operator atelier::PointsView() const { return {data_, rows_, 3}; }

 private:
  object seen_;
  atelier::Points copy_;
  const double* data_ = nullptr;
  Eigen::Index rows_ = 0;
};

template <class Scalar>
struct NumberVectorCaster {
  using Values = std::vector<Scalar>;
  PYBIND11_TYPE_CASTER(Values, const_name("numpy.ndarray"));

  bool load(handle given, bool /*convert*/) {
    using Number = std::conditional_t<std::is_same_v<Scalar, char>, std::int8_t, Scalar>;
    const auto numbers =
        atelier::python::matrix_of<Eigen::Matrix<Number, Eigen::Dynamic, 1>>(given);
    value.assign(numbers.data(), numbers.data() + numbers.size());
    return true;
  }
  static handle cast(Values values, return_value_policy /*policy*/, handle /*parent*/) {
    return atelier::python::array_of(std::move(values)).release();
  }
};

template <>
struct type_caster<std::vector<int>> : NumberVectorCaster<int> {};
template <>
struct type_caster<std::vector<char>> : NumberVectorCaster<char> {};
template <>
struct type_caster<std::vector<std::uint8_t>> : NumberVectorCaster<std::uint8_t> {};
template <>
struct type_caster<std::vector<std::int64_t>> : NumberVectorCaster<std::int64_t> {};
template <>
struct type_caster<std::vector<float>> : NumberVectorCaster<float> {};
template <>
struct type_caster<std::vector<double>> : NumberVectorCaster<double> {};

}  // namespace pybind11::detail
