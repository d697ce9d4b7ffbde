#pragma once

#include <mutex>

namespace atelier {

/// HDF5 as distributed is not safe for several threads: who calls it, or forks a process that will,
/// holds this.
std::mutex& hdf5_mutex();

}  // namespace atelier
