#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// Content of a foreign HDF5 file.
struct ForeignHdf5Contents {
  /// Datasets that can be read, "group/name", with types and shapes but no data.
  std::map<std::string, Tensor> datasets;
  /// Attributes of root, groups and datasets: "group/name@attribute", "@attribute" for the root's.
  std::vector<std::string> attributes;
  /// Content that cannot be read, and why: links out of the file, types that are no numbers, ...
  std::map<std::string, std::string> left_out;
};

/// Reads HDF5 files of others (capture data sets). HDF5's own reader crashes on malformed files, so
/// that it runs in a process of its own with little memory, little time and no access to any file
/// (run_in_worker); if that dies, the file is refused with DataError.
///
/// Inside, only what a plain data file needs is read: hard links, integers, floating-point numbers
/// (float16 becomes float32), enumerations (as their integers; h5py's bool as bool), strings of
/// fixed or variable length; stored plain, chunked or compact; filters deflate, shuffle and
/// Fletcher-32. Links to other files, soft links, external storage, virtual datasets, plug-in
/// filters, compound types and references are refused. Groups are followed to a depth of 32, each
/// object once.
///
/// One call starts one process and reads the whole file's tables again: ask for many names at once.
///
/// @throws DataError with the name in the file and the reason; also if what is asked for is not
/// there
ForeignHdf5Contents foreign_hdf5_contents(const std::filesystem::path& path,
                                          const Limits& limits = {});

/// Datasets and attributes by the names that foreign_hdf5_contents gives.
std::map<std::string, Tensor> read_foreign_hdf5(const std::filesystem::path& path,
                                                const std::vector<std::string>& names,
                                                const Limits& limits = {});

/// The same from memory. @param file  name for errors
ForeignHdf5Contents parse_foreign_hdf5_contents(std::span<const std::byte> bytes,
                                                const std::string& file = "",
                                                const Limits& limits = {});
std::map<std::string, Tensor> parse_foreign_hdf5(std::span<const std::byte> bytes,
                                                 const std::vector<std::string>& names,
                                                 const std::string& file = "",
                                                 const Limits& limits = {});

}  // namespace atelier
