#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// Reads one array of NumPy's npy format (versions 1 to 3; NEP 1 and numpy.lib.format): bool,
/// integers, float16 to float64, complex, strings (S, U) as UTF-8; either byte order; C or Fortran
/// order, returned row-major. Not-a-number elements are read: whether they are allowed is for the
/// caller (check_finite).
///
/// DataError, with the place, for anything else: object arrays (they hold pickled Python, which is
/// never run), structured types, dates, long double, headers that are no plain dictionary, shapes
/// that the bytes of the file do not pay for, bytes after the array.
Tensor parse_npy(std::span<const std::byte> bytes, const std::string& file = "",
                 const Limits& limits = {});

/// Reads a .npy file.
Tensor read_npy(const std::filesystem::path& path, const Limits& limits = {});

/// The npy bytes (version 1.0) of a tensor; texts as unicode, so that NumPy finds names by str.
/// LogicError for BFloat16, which NumPy does not have, and texts that are no UTF-8 without NUL.
std::vector<std::byte> npy_bytes(const Tensor& tensor);

}  // namespace atelier
