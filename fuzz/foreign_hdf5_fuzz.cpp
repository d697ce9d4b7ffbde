#include <algorithm>
#include <string>
#include <vector>

#include "core/io/foreign_hdf5.h"
#include "fuzz/reader.h"

// The reader starts a process per file, so that crashes of HDF5 end there and are refusals; what is
// tried here is that process, its limits and the reading of its answer.
ATELIER_FUZZ_READER(foreign_hdf5) {
  atelier::Limits limits;
  limits.worker_cpu_seconds = 2;
  limits.worker_memory_bytes = 256 << 20;
  const atelier::ForeignHdf5Contents contents =
      atelier::parse_foreign_hdf5_contents(bytes, "hdf5", limits);
  std::vector<std::string> names = contents.attributes;
  for (const auto& [name, tensor] : contents.datasets) {
    names.push_back(name);
  }
  names.resize(std::min<std::size_t>(names.size(), 100));
  for (const auto& [name, tensor] : atelier::parse_foreign_hdf5(bytes, names, "hdf5", limits)) {
    atelier::check_tensor(tensor);
  }
  if (!contents.left_out.empty()) {
    const auto& [name, why] = *contents.left_out.begin();
    throw atelier::DataError("hdf5", name, why, "a dataset that can be read");
  }
}
