#include "appearance/training.h"
#include "core/io/safetensors.h"
#include "fuzz/reader.h"

/// A training that can go on; what is read can be written and reads the same. As of a network
/// (appearance_model), planes of 16 x 16 texels are added where they are missing: they and their
/// moments have 18 KB.
ATELIER_FUZZ_READER(training) {
  atelier::Safetensors found = atelier::parse_safetensors(bytes, "checkpoint");
  const atelier::Tensor plane =
      atelier::tensor_of(std::vector<float>(std::size_t{3} * 16 * 16, 0.5F), {3, 16, 16});
  for (const char* name : {"texture.mean", "static.texture"}) {
    found.tensors.try_emplace(name, plane);
  }
  if (found.tensors.contains("moment.m.gain.log")) {
    for (const char* name : {"moment.m.texture.mean", "moment.v.texture.mean"}) {
      found.tensors.try_emplace(name, plane);
    }
  }
  const atelier::Training training =
      atelier::training_of(found.tensors, found.metadata, "checkpoint");
  const atelier::Training again =
      atelier::training_of(atelier::tensors_of(training), atelier::texts_of(training), "written");
  ATELIER_CHECK(again.iteration == training.iteration && again.options == training.options &&
                    again.data == training.data &&
                    again.moments.size() == training.moments.size() &&
                    again.model.parameters.size() == training.model.parameters.size(),
                "a training reads back as it was");
  for (const auto& [name, moment] : training.moments) {
    ATELIER_CHECK(again.moments.at(name).data == moment.data, "moments read back");
  }
}
