#include "core/io/safetensors.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(safetensors) {
  const atelier::Safetensors content = atelier::parse_safetensors(bytes, "safetensors");
  std::size_t held = 0;
  for (const auto& [name, tensor] : content.tensors) {
    atelier::check_tensor(tensor);
    held += tensor.data.size();
  }
  ATELIER_CHECK(held <= bytes.size(), "tensors held more than the bytes of the file");
  const atelier::Safetensors again =
      atelier::parse_safetensors(atelier::safetensors_bytes(content), "safetensors");
  ATELIER_CHECK(
      again.metadata == content.metadata && again.tensors.size() == content.tensors.size(),
      "safetensors do not round-trip");
}
