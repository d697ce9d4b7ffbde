#include "core/io/mesh_sequence_file.h"
#include "core/io/safetensors.h"
#include "fuzz/reader.h"

/// The arrays of a sequence in one file; the names of joints, which safetensors cannot hold, are
/// added where there are joints. Every frame is a mesh.
ATELIER_FUZZ_READER(mesh_sequence) {
  std::map<std::string, atelier::Tensor> arrays =
      atelier::parse_safetensors(bytes, "sequence").tensors;
  if (arrays.contains("joints")) {
    arrays["joint_names"] = {atelier::ElementType::Text, {2}, {}, {"neck", "nose"}};
  }
  const atelier::MeshSequenceFile file = atelier::mesh_sequence_of(arrays, "sequence");
  const atelier::Index frames = atelier::frame_count(file.sequence);
  ATELIER_CHECK(frames > 0 && (file.joints.empty() || file.names.size() == 2),
                "a sequence without frames, or joints without names");
  for (atelier::Index i = 0; i < frames; ++i) {
    atelier::check_mesh(atelier::frame(file.sequence, i), "sequence");
    ATELIER_CHECK(file.sequence.frame_ids[static_cast<std::size_t>(i)] >= i, "frames out of order");
  }
}
