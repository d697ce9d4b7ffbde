#pragma once

namespace atelier {

/// A dense matrix, column by column. `lead`: numbers from column to column, a multiple of 8; rows
/// that the matrix has not are zeros. In column k the rows before k, rounded down to a multiple of
/// 8, are zeros that need not be read.
template <class T>
struct FactorPanel {
  const T* values;
  int lead;
  int columns;
};

/// s += P b for three right hand sides: `b` [3, columns], `s` [3, lead], neither in `panel`.
void add_product(const FactorPanel<float>& panel, const float* b, float* s);
void add_product(const FactorPanel<double>& panel, const double* b, double* s);

/// z = P^T s: `s` [3, lead], `z` [3, columns].
void transposed_product(const FactorPanel<float>& panel, const float* s, float* z);
void transposed_product(const FactorPanel<double>& panel, const double* s, double* z);

}  // namespace atelier
