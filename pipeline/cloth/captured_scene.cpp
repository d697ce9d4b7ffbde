#include "pipeline/cloth/captured_scene.h"

#include <algorithm>

#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "core/store/derived_folder.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

void append(Mesh& all, const Mesh& mesh) {
  const Index v = all.vertices.rows();
  const Index f = all.faces.rows();
  all.vertices.conservativeResize(v + mesh.vertices.rows(), 3);
  all.vertices.bottomRows(mesh.vertices.rows()) = mesh.vertices;
  all.faces.conservativeResize(f + mesh.faces.rows(), 3);
  all.faces.bottomRows(mesh.faces.rows()) = mesh.faces.array() + static_cast<int>(v);
}

}  // namespace

std::vector<fs::path> registered_folders(const fs::path& registered) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(registered / "registered")) {
    folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  if (folders.empty()) {
    throw DataError(registered.string(), "registered", "no garment", "at least one");
  }
  return folders;
}

fs::path captured_scene(const fs::path& workspace) {
  const fs::path registered = required_result(workspace, "register");
  const fs::path bodies = required_result(workspace, "body");
  return derived_folder(workspace, "scene", {registered, bodies}, [&](const fs::path& folder) {
    Mesh garments;
    std::vector<int> ids;
    for (const fs::path& one : registered_folders(registered)) {
      const Sequence sequence = open_sequence(one);
      ids = sequence.frame_ids;
      append(garments, frame(sequence, 0));
    }
    write_mesh(folder / "garment.obj", garments);
    const Sequence all = open_sequence(bodies);
    SequenceHeader header;
    header.fps = all.fps;
    header.shared.faces = all.faces;
    std::vector<Index> rows;
    for (Index i = 0; i < frame_count(all); ++i) {
      const int id = all.frame_ids[static_cast<std::size_t>(i)];
      if (std::find(ids.begin(), ids.end(), id) != ids.end()) {
        header.frame_ids.push_back(id);
        rows.push_back(i);
      }
    }
    if (rows.empty() || header.frame_ids.front() != ids.front()) {
      throw DataError(bodies.string(), "frames", "not those of the registered garments",
                      "a body in every frame that a garment was registered to");
    }
    write_sequence_header(folder / "body", header);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Mesh body;
      body.vertices = frame(all, rows[i]).vertices;
      body.faces = all.faces;
      write_sequence_frame(folder / "body", header, header.frame_ids[i], body);
    }
  });
}

}  // namespace atelier
