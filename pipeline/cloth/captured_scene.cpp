#include "pipeline/cloth/captured_scene.h"

#include <algorithm>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "core/store/derived_folder.h"
#include "registration/tracking/holding_file.h"

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

/// The registered garments in every frame, all in one mesh; returns the first.
Mesh write_captured(const fs::path& folder, const fs::path& registered) {
  std::vector<Sequence> garments;
  for (const fs::path& one : registered_folders(registered)) {
    garments.push_back(open_sequence(one));
  }
  const auto joined = [&](Index row) {
    Mesh all;
    for (const Sequence& one : garments) {
      append(all, frame(one, row));
    }
    return all;
  };
  const Mesh first = joined(0);
  SequenceHeader header;
  header.fps = garments.front().fps;
  header.frame_ids = garments.front().frame_ids;
  header.shared.faces = first.faces;
  write_sequence_header(folder, header);
  for (std::size_t i = 0; i < header.frame_ids.size(); ++i) {
    write_sequence_frame(folder, header, header.frame_ids[i], joined(static_cast<Index>(i)));
  }
  return first;
}

/// What holds the garments, in the numbers of the one mesh that they are here.
void write_holding(const fs::path& folder, const fs::path& registered) {
  if (!fs::exists(registered / kHoldingFile)) {
    return;
  }
  const std::vector<HeldRing> rings = read_holding(registered / kHoldingFile);
  std::vector<HeldRing> joined;
  int before = 0;
  for (const fs::path& one : registered_folders(registered)) {
    const std::string name = one.filename().string();
    for (HeldRing ring : rings_of(rings, name)) {
      ring.garment = "garment";
      ring.opening = name + " " + ring.opening;
      for (int& v : ring.vertices) {
        v += before;
      }
      joined.push_back(std::move(ring));
    }
    before += static_cast<int>(frame(open_sequence(one), 0).vertices.rows());
  }
  write_file_atomically(folder / kHoldingFile, holding_text(joined));
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
    const Mesh garments = write_captured(folder / kCapturedFolder, registered);
    const std::vector<int> ids = open_sequence(folder / kCapturedFolder).frame_ids;
    write_mesh(folder / "garment.obj", garments);
    write_holding(folder, registered);
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
