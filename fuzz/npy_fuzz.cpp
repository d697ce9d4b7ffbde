#include "core/io/npy.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(npy) {
  const atelier::Tensor tensor = atelier::parse_npy(bytes, "npy");
  atelier::check_tensor(tensor);
  if (tensor.type != atelier::ElementType::Text) {
    // What is written is read again to the same bytes.
    const atelier::Tensor again = atelier::parse_npy(atelier::npy_bytes(tensor), "npy");
    ATELIER_CHECK(again.data == tensor.data && again.shape == tensor.shape, "no round trip");
  }
}
