#pragma once

#include <cstddef>
#include <cstdint>

namespace atelier {

/// Ceilings for everything that is read. A file never raises them; callers may. A count n is paid
/// for by the bytes that remain before memory is taken: n * (smallest element) <= bytes left.
///
/// Not among them, since no caller has a reason to choose: what bounds the work of one format's
/// reader alone and stands beside it, such as kMaxScans (image_jpeg.cpp: each costs a pass over the
/// image), kMaxElements and kMaxProperties (ply_header.cpp), kMaxCorners and kMaxFaceCorners
/// (mesh_obj_read.cpp, mesh_ply_read.cpp: cutting a face into triangles costs their square),
/// kMaxNodes and kMaxInfluences (fbx_import.cpp, fbx_mesh.cpp: what glTF can say of one vertex),
/// kMaxColumns (table_text.cpp) and kMaxModelBytes (detect_capture.cpp: what its library can hold);
/// kMaxPeople (capture/person_id.h), which keeps an id an int; and kMaxFiles
/// (core/store/manifest_limits.h), of manifests that the store has written itself: they may name
/// more than JSON from elsewhere.
struct Limits {
  std::int64_t image_side = 16'384;              ///< pixels
  std::int64_t image_pixels = 64'000'000;        ///< width x height
  std::int64_t image_file_bytes = 256LL << 20;   ///< encoded
  std::int64_t mesh_vertices = 20'000'000;       ///< also texture coordinates, normals
  std::int64_t mesh_faces = 40'000'000;          ///< after triangulation
  std::int64_t mesh_file_bytes = 4LL << 30;      ///< OBJ, PLY, glTF
  double mesh_coordinate = 1e9;                  ///< of positions and uvs, in the file's unit
  std::int64_t line_bytes = 1LL << 20;           ///< one line of a text format
  std::int64_t tensor_rank = 8;                  ///< npy, safetensors, HDF5
  std::int64_t tensor_bytes = 16LL << 30;        ///< one array
  std::int64_t inflate_ratio = 1'000;            ///< declared or inflated bytes per stored byte
  std::int64_t inflate_free_bytes = 64LL << 20;  ///< below this the ratio is not judged
  std::int64_t archive_entries = 65'536;         ///< npz, zip
  std::int64_t safetensors_header_bytes = 1LL << 20;  ///< JSON header
  std::int64_t safetensors_entries = 65'536;          ///< tensors in one file
  std::int64_t text_file_bytes = 64LL << 20;          ///< JSON, TOML, CSV, YAML
  std::int64_t text_depth = 64;                       ///< nesting of JSON and TOML
  std::int64_t text_string_bytes = 64LL << 10;        ///< one JSON or TOML string
  std::int64_t text_values = 8'000'000;               ///< values in one JSON or TOML text
  std::int64_t cameras = 1'024;
  std::int64_t camera_side = 65'536;  ///< pixels, as a calibration says it; images: image_side
  std::int64_t joints = 1'024;
  std::int64_t frames = 1'000'000;
  std::int64_t motion_file_bytes = 1LL << 30;    ///< BVH, AMC, TRC
  std::int64_t worker_memory_bytes = 2LL << 30;  ///< address space of a foreign-file worker
  std::int64_t worker_cpu_seconds = 10;          ///< its processor time
};

}  // namespace atelier
