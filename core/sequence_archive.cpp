#include "core/sequence_archive.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr const char* kMeshSchema = "atelier.mesh";
constexpr const char* kSequenceSchema = "atelier.sequence";
constexpr int kSequenceVersion = 1;

/// Takes arrays out of an archive; what is left over at the end was never meant to be there.
class Fields {
 public:
  Fields(const Archive& archive, const std::string& file) : archive_(archive), file_(file) {
    if (archive.units != "m" || archive.up_axis != "y") {
      throw DataError(file, "units", archive.units + ", up " + archive.up_axis, "m, up y");
    }
  }

  /// A matrix with rows of the element type of `Rows`; no rows if the archive has none.
  template <class Rows>
  Rows rows(const std::string& name) {
    using T = typename Rows::Scalar;
    const Tensor* tensor = find(name, element_type_for<T>(), 2);
    if (tensor == nullptr) {
      return Rows(0, Rows::ColsAtCompileTime);
    }
    if (tensor->shape[1] != Rows::ColsAtCompileTime) {
      fail(name, shape_text(tensor->shape),
           "[rows," + std::to_string(static_cast<int>(Rows::ColsAtCompileTime)) + "]");
    }
    return Eigen::Map<const Rows>(values_of<T>(*tensor).data(), tensor->shape[0], tensor->shape[1]);
  }

  template <class T>
  std::vector<T> vector(const std::string& name) {
    const Tensor* tensor = find(name, element_type_for<T>(), 1);
    if (tensor == nullptr) {
      return {};
    }
    const auto values = values_of<T>(*tensor);
    return {values.begin(), values.end()};
  }

  void check_all_taken() const {
    for (const auto& entry : archive_.datasets) {
      if (std::find(taken_.begin(), taken_.end(), entry.first) == taken_.end()) {
        fail(entry.first, "not of this schema", "only what docs/reference/formats.md names");
      }
    }
  }

  [[noreturn]] void fail(const std::string& name, const std::string& found,
                         const std::string& expected) const {
    throw DataError(file_, name, found, expected);
  }

 private:
  const Tensor* find(const std::string& name, ElementType type, std::size_t rank) {
    taken_.push_back(name);
    const auto found = archive_.datasets.find(name);
    if (found == archive_.datasets.end()) {
      return nullptr;
    }
    if (found->second.type != type || found->second.shape.size() != rank) {
      fail(name,
           std::string(element_type_name(found->second.type)) + " " +
               shape_text(found->second.shape),
           std::string(element_type_name(type)) + " of rank " + std::to_string(rank));
    }
    return &found->second;
  }

  const Archive& archive_;
  const std::string& file_;
  std::vector<std::string> taken_;
};

template <class Rows>
void put(Archive& archive, const std::string& name, const Rows& rows) {
  if (rows.rows() > 0) {
    archive.datasets[name] = tensor_of(rows);
  }
}

/// Everything of a mesh, without judging it: a frame has no faces of its own.
Archive unchecked_archive_of(const Mesh& mesh) {
  Archive archive;
  archive.schema = kMeshSchema;
  archive.version = kSequenceVersion;
  put(archive, "vertices", mesh.vertices);
  put(archive, "faces", mesh.faces);
  put(archive, "normals", mesh.normals);
  put(archive, "colors", mesh.colors);
  put(archive, "uvs", mesh.uvs);
  put(archive, "uv_faces", mesh.uv_faces);
  if (!mesh.labels.empty()) {
    archive.datasets["labels"] = tensor_of(mesh.labels);
  }
  if (mesh.confidence.size() > 0) {
    archive.datasets["confidence"] =
        tensor_of(std::span<const float>(mesh.confidence.data(),
                                         static_cast<std::size_t>(mesh.confidence.size())),
                  {mesh.confidence.size()});
  }
  return archive;
}

/// Values that are not finite pass: check_mesh finds them.
void check_coordinates(const Mesh& mesh, const std::string& file, const Limits& limits) {
  const auto check = [&](const auto& rows, const char* name) {
    const double most = rows.size() == 0 ? 0 : rows.cwiseAbs().maxCoeff();
    if (std::isfinite(most) && most > limits.mesh_coordinate) {
      char found[32];
      char allowed[32];
      std::snprintf(found, sizeof found, "coordinate %g", most);
      std::snprintf(allowed, sizeof allowed, "at most %g", limits.mesh_coordinate);
      throw DataError(file, name, found, allowed);
    }
  };
  check(mesh.vertices, "vertices");
  check(mesh.uvs, "uvs");
}

Mesh unchecked_mesh_of(const Archive& archive, const std::string& file, const Limits& limits = {}) {
  Fields fields(archive, file);
  Mesh mesh;
  mesh.vertices = fields.rows<Points>("vertices");
  mesh.faces = fields.rows<Triangles>("faces");
  mesh.normals = fields.rows<Points>("normals");
  mesh.colors = fields.rows<Colors>("colors");
  mesh.uvs = fields.rows<Points2>("uvs");
  mesh.uv_faces = fields.rows<Triangles>("uv_faces");
  mesh.labels = fields.vector<std::uint8_t>("labels");
  const std::vector<float> confidence = fields.vector<float>("confidence");
  mesh.confidence =
      Eigen::Map<const Eigen::VectorXf>(confidence.data(), static_cast<Index>(confidence.size()));
  fields.check_all_taken();
  check_coordinates(mesh, file, limits);
  return mesh;
}

bool has_topology(const SequenceHeader& header) {
  return header.shared.faces.rows() > 0;
}

/// The fault of a header, or "".
std::string header_fault(const SequenceHeader& header) {
  if (!std::isfinite(header.fps) || header.fps <= 0) {
    return short_number(header.fps) + " frames per second";
  }
  for (std::size_t i = 0; i < header.frame_ids.size(); ++i) {
    if (header.frame_ids[i] < 0 || (i > 0 && header.frame_ids[i] <= header.frame_ids[i - 1])) {
      return "frame ids that do not increase from 0 or more, at entry " + std::to_string(i);
    }
  }
  return "";
}

/// The fault of the part that frames share, or "". The number of vertices is in each frame.
std::string shared_fault(const Mesh& shared) {
  if (shared.vertices.rows() > 0 || shared.normals.rows() > 0 || shared.colors.rows() > 0 ||
      !shared.labels.empty() || shared.confidence.size() > 0) {
    return "arrays of vertices";
  }
  if (shared.faces.rows() > 0 && shared.faces.minCoeff() < 0) {
    return "a face of a vertex below 0";
  }
  if (shared.uv_faces.rows() > 0 &&
      (shared.uv_faces.rows() != shared.faces.rows() || shared.uv_faces.minCoeff() < 0 ||
       shared.uv_faces.maxCoeff() >= shared.uvs.rows())) {
    return "texture faces that fit neither faces nor coordinates";
  }
  return shared.uvs.allFinite() ? "" : "a texture coordinate that is not finite";
}

std::filesystem::path header_path(const std::filesystem::path& folder) {
  return folder / "sequence.h5";
}

Mesh with_topology(Mesh frame, const SequenceHeader& header, const std::string& file) {
  if (!has_topology(header)) {
    return frame;
  }
  if (frame.faces.rows() > 0 || frame.uvs.rows() > 0 || frame.uv_faces.rows() > 0) {
    throw DataError(file, "faces", "a topology of its own", "the one of the sequence");
  }
  frame.faces = header.shared.faces;
  frame.uvs = header.shared.uvs;
  frame.uv_faces = header.shared.uv_faces;
  return frame;
}

}  // namespace

Archive archive_of(const Mesh& mesh) {
  check_mesh(mesh);
  return unchecked_archive_of(mesh);
}

Mesh mesh_of(const Archive& archive, const std::string& file) {
  Mesh mesh = unchecked_mesh_of(archive, file);
  check_mesh(mesh, file);
  return mesh;
}

void write_mesh_archive(const std::filesystem::path& path, const Mesh& mesh) {
  write_archive(path, archive_of(mesh));
}

Mesh read_mesh_archive(const std::filesystem::path& path, const Limits& limits) {
  Mesh mesh = unchecked_mesh_of(read_archive(path, kMeshSchema, kSequenceVersion, limits),
                                path.string(), limits);
  check_mesh(mesh, path.string());
  return mesh;
}

Archive archive_of(const SequenceHeader& header) {
  const std::string fault = header_fault(header);
  ATELIER_CHECK(fault.empty(), fault);
  ATELIER_CHECK(header.shared.vertices.rows() == 0, "vertices are of frames, not shared");
  Archive archive = unchecked_archive_of(header.shared);
  archive.schema = kSequenceSchema;
  archive.numbers["fps"] = header.fps;
  archive.datasets["frame_ids"] = tensor_of(header.frame_ids);
  return archive;
}

void write_sequence_header(const std::filesystem::path& folder, const SequenceHeader& header) {
  const Archive archive = archive_of(header);
  make_private_directory(folder);
  write_archive(header_path(folder), archive);
}

void write_sequence_frame(const std::filesystem::path& folder, const SequenceHeader& header,
                          int frame_id, const Mesh& mesh) {
  ATELIER_CHECK(std::binary_search(header.frame_ids.begin(), header.frame_ids.end(), frame_id),
                "frame " + std::to_string(frame_id) + " is not one of the sequence");
  const std::string place = "frame " + std::to_string(frame_id);
  check_mesh(mesh, place);
  Mesh own = mesh;
  if (has_topology(header)) {
    if (!equal_arrays(mesh.faces, header.shared.faces) ||
        !equal_arrays(mesh.uv_faces, header.shared.uv_faces) ||
        !equal_arrays(mesh.uvs, header.shared.uvs)) {
      throw DataError(place, "faces", "another topology", "that of the sequence");
    }
    own.faces.resize(0, 3);
    own.uvs.resize(0, 2);
    own.uv_faces.resize(0, 3);
  }
  make_private_directory(folder / "frames");
  write_archive(sequence_frame_path(folder, frame_id), unchecked_archive_of(own));
}

void write_sequence(const std::filesystem::path& folder, const Sequence& sequence) {
  SequenceHeader header{sequence.fps, sequence.frame_ids, {}};
  if (sequence.faces.rows() > 0) {
    header.shared.faces = sequence.faces;
    if (frame_count(sequence) > 0) {
      const Mesh first = frame(sequence, 0);
      header.shared.uvs = first.uvs;
      header.shared.uv_faces = first.uv_faces;
    }
  }
  write_sequence_header(folder, header);
  for (Index i = 0; i < frame_count(sequence); ++i) {
    write_sequence_frame(folder, header, header.frame_ids[static_cast<std::size_t>(i)],
                         frame(sequence, i));
  }
}

SequenceHeader sequence_header_of(Archive archive, const std::string& file, const Limits& limits) {
  SequenceHeader header;
  const auto fps = archive.numbers.find("fps");
  if (fps == archive.numbers.end()) {
    throw DataError(file, "fps", "missing", "frames per second");
  }
  header.fps = fps->second;
  const auto ids = archive.datasets.extract("frame_ids");
  if (ids.empty() || ids.mapped().type != ElementType::Int32 || ids.mapped().shape.size() != 1) {
    throw DataError(file, "frame_ids", "missing or of another type", "int32 of rank 1");
  }
  const auto values = values_of<int>(ids.mapped());
  header.frame_ids.assign(values.begin(), values.end());
  header.shared = unchecked_mesh_of(archive, file, limits);
  if (const std::string fault = header_fault(header); !fault.empty()) {
    throw DataError(file, "header", fault, "a sequence");
  }
  if (const std::string fault = shared_fault(header.shared); !fault.empty()) {
    throw DataError(file, "header", fault, "faces and texture coordinates of every frame");
  }
  if (static_cast<std::int64_t>(header.frame_ids.size()) > limits.frames) {
    throw DataError(file, "frame_ids", std::to_string(header.frame_ids.size()) + " frames",
                    "at most " + std::to_string(limits.frames));
  }
  return header;
}

SequenceHeader read_sequence_header(const std::filesystem::path& folder, const Limits& limits) {
  const std::filesystem::path path = header_path(folder);
  return sequence_header_of(read_archive(path, kSequenceSchema, kSequenceVersion, limits),
                            path.string(), limits);
}

Sequence open_sequence(const std::filesystem::path& folder, const Limits& limits) {
  const auto header = std::make_shared<const SequenceHeader>(read_sequence_header(folder, limits));
  Sequence sequence;
  sequence.fps = header->fps;
  sequence.frame_ids = header->frame_ids;
  sequence.faces = header->shared.faces;
  sequence.load = [folder, header, limits](Index frame_idx) {
    const std::filesystem::path path =
        sequence_frame_path(folder, header->frame_ids[static_cast<std::size_t>(frame_idx)]);
    Mesh mesh =
        with_topology(unchecked_mesh_of(read_archive(path, kMeshSchema, kSequenceVersion, limits),
                                        path.string(), limits),
                      *header, path.string());
    check_mesh(mesh, path.string());
    return mesh;
  };
  return sequence;
}

std::filesystem::path sequence_frame_path(const std::filesystem::path& folder, int frame_id) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.h5", frame_id);
  return folder / "frames" / name;
}

}  // namespace atelier
