#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/mesh.h"

namespace atelier {

/// Building blocks of the schemas of archives. Reading throws DataError with `file` in it where an
/// array has another type or shape than asked for, or names what is not there.

/// A list of texts.
Tensor tensor_of_texts(const std::vector<std::string>& values);

/// A dataset that HDF5 can hold: those without elements are left out.
void put_array(Archive& archive, const std::string& name, Tensor tensor);

/// The arrays of a mesh as "<group>/vertices", ...; back. Throws DataError unless it is valid.
void put_mesh(Archive& archive, const std::string& group, const Mesh& mesh);
Mesh mesh_at(const Archive& archive, const std::string& group, const std::string& file);

/// Throws DataError unless lengths are in metres and Y is up.
void check_units(const Archive& archive, const std::string& file);

/// Throws DataError for a dataset that the schema does not name.
void check_names(const Archive& archive, const std::string& file,
                 const std::function<bool(const std::string&)>& is_named);

/// Null where there is none.
const Tensor* find_array(const Archive& archive, const std::string& name);

/// Throws DataError where there is none.
const Tensor& array_at(const Archive& archive, const std::string& name, const std::string& file);

/// No texts where it is absent.
std::vector<std::string> texts_at(const Archive& archive, const std::string& name,
                                  const std::string& file);

/// Indices into `count` things, in the order of the file.
std::vector<int> indices_of(const Tensor& tensor, Index count, const std::string& file,
                            const std::string& name);

/// Finite floats of this very shape; of a valid archive, whose bytes they are.
std::span<const float> floats_at(const Archive& archive, const std::string& name,
                                 const std::vector<std::int64_t>& shape, const std::string& file);

/// [N,columns] of numbers; no rows where it is absent. `columns`, `rows` below 0: any number.
template <class Matrix>
Matrix rows_at(const Archive& archive, const std::string& name, Index columns, Index rows,
               const std::string& file) {
  const Tensor* tensor = find_array(archive, name);
  Matrix matrix =
      tensor == nullptr
          ? Matrix(0, columns < 0 ? 0 : columns)
          : Matrix(
                matrix_of(*tensor, columns, file, name).template cast<typename Matrix::Scalar>());
  if (rows >= 0 && matrix.rows() != rows) {
    throw DataError(file, name, std::to_string(matrix.rows()) + " rows", std::to_string(rows));
  }
  return matrix;
}

/// [N,columns] of indices into `count` things; no rows where it is absent. `columns` below 0: any.
template <class Matrix>
Matrix index_rows_at(const Archive& archive, const std::string& name, Index columns, Index count,
                     const std::string& file) {
  const Tensor* tensor = find_array(archive, name);
  if (tensor == nullptr) {
    return Matrix(0, columns < 0 ? 0 : columns);
  }
  if (tensor->shape.size() != 2 || (columns >= 0 && tensor->shape[1] != columns)) {
    throw DataError(file, name, shape_text(tensor->shape), "rows of indices");
  }
  const std::vector<int> indices = indices_of(*tensor, count, file, name);
  return Eigen::Map<const Matrix>(indices.data(), tensor->shape[0], tensor->shape[1]);
}

}  // namespace atelier
