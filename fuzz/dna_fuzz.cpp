#include "capture/layouts/dna.h"
#include "core/io/safetensors.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

/// Arrays as the worker gives them (foreign_hdf5 is the reader of the container): those under
/// "main/" are of the file of images, the others annotations.
ATELIER_FUZZ_READER(dna) {
  DnaFiles files{"main.smc", "annots.smc", {}, {}};
  std::map<std::string, Tensor> arrays;
  for (auto& [name, tensor] : parse_safetensors(bytes, "dna").tensors) {
    const bool in_main = name.starts_with("main/");
    Tensor listed = tensor;
    listed.data.clear();
    if (in_main) {
      files.in_main.datasets[name.substr(5)] = std::move(listed);
    } else {
      files.in_annotations.datasets[name] = std::move(listed);
      arrays[name] = std::move(tensor);
    }
  }
  const Dataset dataset =
      dna_dataset(files, [&](const std::vector<std::string>&) { return arrays; });
  check_finite_cameras(dataset.cameras);
  ATELIER_CHECK(dataset.frames.size() == dataset.cameras.size(), "frames of other cameras");
}
