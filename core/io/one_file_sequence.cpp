#include "core/io/one_file_sequence.h"

#include <vector>

#include "core/archive.h"

namespace atelier {

void write_one_file_sequence(const std::filesystem::path& path, const Sequence& sequence) {
  const Index count = frame_count(sequence);
  const Index vertices = frame(sequence, 0).vertices.rows();
  std::vector<float> values;
  values.reserve(static_cast<std::size_t>(count * vertices * 3));
  for (Index i = 0; i < count; ++i) {
    const Points x = frame(sequence, i).vertices;
    for (Index v = 0; v < x.rows(); ++v) {
      for (int c = 0; c < 3; ++c) {
        values.push_back(static_cast<float>(x(v, c)));
      }
    }
  }
  Archive archive;
  archive.schema = "atelier.mesh_sequence";
  archive.datasets["vertices"] = tensor_of(values, {count, vertices, 3});
  archive.datasets["faces"] = tensor_of(sequence.faces);
  archive.datasets["fps"] = tensor_of(std::vector<double>{sequence.fps}, {1});
  archive.datasets["frame_ids"] =
      tensor_of(sequence.frame_ids, {static_cast<std::int64_t>(sequence.frame_ids.size())});
  write_archive(path, archive);
}

}  // namespace atelier
