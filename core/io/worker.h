#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/limits.h"

namespace atelier {

/// Runs `work` in a process of its own that cannot do harm: `limits.worker_memory_bytes` more
/// memory than it begins with, `limits.worker_cpu_seconds` of processor time, no file can be opened
/// or written, no network, no program started (rlimits, no-new-privileges and, on x86-64, a seccomp
/// list of allowed calls). For libraries that are not safe on hostile files.
///
/// The result of `work` is returned through a pipe. Its DataError is thrown here too. If the
/// process dies or is stopped, that is a DataError with the signal: the data are at fault, not the
/// program. It can be no EnvironmentError but for a machine that cannot start processes.
///
/// @param work  runs in the child: may read all memory of the caller, changes none of it
/// @param file  name for errors
std::vector<std::byte> run_in_worker(const std::function<std::vector<std::byte>()>& work,
                                     const std::string& file, const Limits& limits);

}  // namespace atelier
