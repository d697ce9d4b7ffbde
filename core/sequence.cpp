#include "core/sequence.h"

#include <memory>
#include <numeric>

#include "core/error.h"

namespace atelier {

Index frame_count(const Sequence& sequence) {
  return static_cast<Index>(sequence.frame_ids.size());
}

Mesh frame(const Sequence& sequence, Index frame_idx) {
  ATELIER_CHECK(
      frame_idx >= 0 && frame_idx < frame_count(sequence),
      "frame " + std::to_string(frame_idx) + " of " + std::to_string(frame_count(sequence)));
  ATELIER_CHECK(sequence.load != nullptr, "a sequence without a reader");
  Mesh mesh = sequence.load(frame_idx);
  const std::string place =
      "frame " + std::to_string(sequence.frame_ids[static_cast<std::size_t>(frame_idx)]);
  check_mesh(mesh, place);
  if (sequence.faces.rows() > 0 && !equal_arrays(mesh.faces, sequence.faces)) {
    throw DataError(place, "faces", "another topology", "that of the sequence");
  }
  return mesh;
}

Sequence sequence_of(std::vector<Mesh> meshes, double fps, std::vector<int> frame_ids) {
  if (frame_ids.empty()) {
    frame_ids.resize(meshes.size());
    std::iota(frame_ids.begin(), frame_ids.end(), 0);
  }
  ATELIER_CHECK(frame_ids.size() == meshes.size(), "one frame id for each mesh");
  Sequence sequence;
  sequence.fps = fps;
  sequence.frame_ids = std::move(frame_ids);
  bool shared = !meshes.empty();
  for (const Mesh& mesh : meshes) {
    shared = shared && equal_arrays(mesh.faces, meshes.front().faces) &&
             mesh.vertices.rows() == meshes.front().vertices.rows();
  }
  if (shared) {
    sequence.faces = meshes.front().faces;
  }
  auto held = std::make_shared<const std::vector<Mesh>>(std::move(meshes));
  sequence.load = [held](Index frame_idx) { return (*held)[static_cast<std::size_t>(frame_idx)]; };
  return sequence;
}

}  // namespace atelier
