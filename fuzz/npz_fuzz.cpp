#include "core/io/npz.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(npz) {
  const atelier::Npz npz({bytes.begin(), bytes.end()}, "npz");
  for (const std::string& name : npz.names()) {
    atelier::check_tensor(npz.read(name));
  }
}
