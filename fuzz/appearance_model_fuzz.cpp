#include "appearance/appearance_model.h"
#include "appearance/texel_map.h"
#include "core/io/safetensors.h"
#include "fuzz/reader.h"

/// A network; what is read can be laid on its texture, written, and reads the same. Of a texture of
/// 16 x 16 texels, the smallest that there is, both planes are added where they are missing: with
/// them no file has less than 6 KB.
ATELIER_FUZZ_READER(appearance_model) {
  atelier::Safetensors found = atelier::parse_safetensors(bytes, "model");
  for (const char* name : {"texture.mean", "static.texture"}) {
    found.tensors.try_emplace(
        name, atelier::tensor_of(std::vector<float>(std::size_t{3} * 16 * 16, 0.5F), {3, 16, 16}));
  }
  const atelier::AppearanceModel model =
      atelier::appearance_model_of(found.tensors, found.metadata, "model");
  const atelier::TexelMap texels = atelier::texel_map(model.faces, model.uvs, model.uv_faces, 16);
  for (const int face : texels.face.data) {
    ATELIER_CHECK(face < model.faces.rows(), "a texel shows a face that there is");
  }
  ATELIER_CHECK(model.faces.maxCoeff() < model.mean_transfer.rows() &&
                    model.static_gain.size() == 3 * model.camera_ids.size(),
                "every vertex and every camera has its values");
  const atelier::AppearanceModel again =
      atelier::appearance_model_of(atelier::tensors_of(model), atelier::texts_of(model), "written");
  ATELIER_CHECK(again.camera_ids == model.camera_ids && again.faces == model.faces &&
                    again.uvs == model.uvs &&
                    again.static_texture.data == model.static_texture.data &&
                    again.mean_transfer == model.mean_transfer,
                "a network reads back as it was");
  for (const auto& [name, tensor] : model.parameters) {
    ATELIER_CHECK(again.parameters.at(name).data == tensor.data, "parameters read back");
  }
}
