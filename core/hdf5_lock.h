#pragma once

#include <mutex>

namespace atelier {

/// HDF5 as distributed is not thread-safe: every caller, and everything that forks a process that
/// will call it, locks this mutex.
std::mutex& hdf5_mutex();

}  // namespace atelier
