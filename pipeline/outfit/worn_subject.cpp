#include "pipeline/outfit/worn_subject.h"

#include <algorithm>

#include "core/error.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

void add(WornSubject& worn, const std::string& name, const Mesh& mesh, int label) {
  worn.subject.names.push_back(name);
  worn.subject.faces.push_back(mesh.faces);
  worn.templates.push_back(mesh);
  worn.labels.push_back(label);
}

/// Vertices of a frame; none where the sequence does not have it.
Points vertices_at(const Sequence& sequence, int frame_id) {
  const auto found =
      std::lower_bound(sequence.frame_ids.begin(), sequence.frame_ids.end(), frame_id);
  if (found == sequence.frame_ids.end() || *found != frame_id) {
    return Points(0, 3);
  }
  return frame(sequence, found - sequence.frame_ids.begin()).vertices;
}

/// The mesh that all frames of a sequence share, in the pose of its first.
Mesh template_of(const fs::path& folder, const Sequence& sequence) {
  const SequenceHeader header = read_sequence_header(folder);
  if (header.shared.uv_faces.rows() == 0 || sequence.frame_ids.empty()) {
    throw DataError(folder.string(), "",
                    sequence.frame_ids.empty() ? "no frame" : "no texture coordinates",
                    "a sequence of meshes with texture coordinates");
  }
  Mesh mesh = header.shared;
  mesh.vertices = frame(sequence, 0).vertices;
  return mesh;
}

}  // namespace

std::vector<Points> surfaces_of(const GroundTruthFrame& frame, const GroundTruth& truth) {
  std::vector<Points> surfaces = {frame.body};
  surfaces.insert(surfaces.end(), frame.layers.begin(), frame.layers.end());
  surfaces.resize(1 + truth.layers.size());
  surfaces.insert(surfaces.end(), frame.garments.begin(), frame.garments.end());
  surfaces.resize(1 + truth.layers.size() + truth.garments.size());
  return surfaces;
}

WornSubject worn_in_truth(const fs::path& capture,
                          const std::shared_ptr<const GroundTruth>& truth) {
  WornSubject worn;
  add(worn, "body", truth->body, static_cast<int>(Label::Skin));
  for (std::size_t i = 0; i < truth->layers.size(); ++i) {
    add(worn, truth->layer_names[i], truth->layers[i], -1);
  }
  worn.first_garment = worn.templates.size();
  for (const GroundTruthGarment& garment : truth->garments) {
    add(worn, garment.garment.name, garment.garment.mesh, static_cast<int>(garment.label));
  }
  worn.subject.load = [truth, capture](int frame_id) {
    return surfaces_of(read_ground_truth_frame(capture, *truth, frame_id), *truth);
  };
  return worn;
}

WornSubject worn_in_workspace(const fs::path& registered, const fs::path& bodies) {
  std::vector<fs::path> folders;
  if (fs::is_directory(registered / "registered")) {
    for (const auto& entry : fs::directory_iterator(registered / "registered")) {
      folders.push_back(entry.path());
    }
  }
  std::sort(folders.begin(), folders.end());
  if (folders.empty()) {
    throw DataError(registered.string(), "registered", "no garment", "what register has written");
  }
  WornSubject worn;
  worn.first_garment = 1;
  std::vector<Sequence> sequences = {open_sequence(bodies)};
  add(worn, "body", template_of(bodies, sequences[0]), static_cast<int>(Label::Skin));
  for (const fs::path& folder : folders) {
    sequences.push_back(open_sequence(folder));
    const std::string name = folder.filename().string();
    const auto label = label_of(name);
    add(worn, name, template_of(folder, sequences.back()), label ? static_cast<int>(*label) : -1);
  }
  worn.subject.load = [sequences](int frame_id) {
    std::vector<Points> surfaces;
    surfaces.reserve(sequences.size());
    for (const Sequence& sequence : sequences) {
      surfaces.push_back(vertices_at(sequence, frame_id));
    }
    return surfaces;
  };
  return worn;
}

}  // namespace atelier
