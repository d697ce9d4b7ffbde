#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/io/foreign_hdf5.h"
#include "core/limits.h"

namespace atelier {

/// The part of foreign_hdf5.h that calls HDF5: to be run inside a worker only, for a malformed file
/// may crash it. Throws DataError with an empty file name.
ForeignHdf5Contents walk_hdf5(std::span<const std::byte> bytes, const Limits& limits);

/// One dataset ("group/name") or attribute ("group/name@attribute") after the other.
std::vector<Tensor> read_hdf5(std::span<const std::byte> bytes,
                              const std::vector<std::string>& names, const Limits& limits);

}  // namespace atelier
