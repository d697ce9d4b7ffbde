#include "python/arrays.h"

#include <cmath>

namespace atelier::python {
namespace {

template <class Scalar>
void find_not_finite(const Scalar* values, Eigen::Index count, Eigen::Index columns) {
  // A sum that only numbers which are not finite change.
  const Eigen::Map<const Eigen::Array<Scalar, Eigen::Dynamic, 1>> numbers(values, count);
  if (count == 0 || (numbers * Scalar{0}).sum() == 0) {
    return;
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!std::isfinite(values[i])) {
      const std::string row = "row " + std::to_string(i / columns);
      throw DataError("", columns == 1 ? row : row + ", column " + std::to_string(i % columns),
                      std::isnan(values[i]) ? "NaN" : "infinity", "a finite number");
    }
  }
}

}  // namespace

void require_finite(const double* values, Eigen::Index count, Eigen::Index columns) {
  find_not_finite(values, count, columns);
}

void require_finite(const float* values, Eigen::Index count, Eigen::Index columns) {
  find_not_finite(values, count, columns);
}

py::array read_only(py::array array) {
  array.attr("setflags")(false);
  return array;
}

std::string array_text(const py::array& array) {
  std::string text = py::str(array.dtype()).cast<std::string>() + " of shape (";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  }
  return text + (array.ndim() == 1 ? ",)" : ")");
}

py::array number_array(py::handle given, bool whole, const std::string& expected) {
  py::array array;
  try {
    array = py::array::ensure(given);  // an array as it is; of lists one is made
  } catch (const py::error_already_set&) {
  }
  if (!array) {
    PyErr_Clear();
    throw DataError(
        "", "", py::str(py::type::handle_of(given).attr("__name__")).cast<std::string>(), expected);
  }
  const char kind = array.dtype().kind();
  const bool is_whole = kind == 'i' || kind == 'u' || kind == 'b';
  if (!is_whole && (kind != 'f' || (whole && array.size() > 0))) {
    throw DataError("", "", array_text(array), expected);
  }
  return array;
}

}  // namespace atelier::python
