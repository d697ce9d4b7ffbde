#pragma once

#include <filesystem>
#include <string>

#include "core/archive.h"
#include "core/mesh.h"
#include "core/sequence.h"

namespace atelier {

/// A mesh as an archive of schema "atelier.mesh", version 1 (docs/reference/formats.md), and back.
/// Empty arrays of the mesh are not written. Throws DataError unless the mesh is valid
/// (check_mesh).
Archive archive_of(const Mesh& mesh);
Mesh mesh_of(const Archive& archive, const std::string& file = "");

void write_mesh_archive(const std::filesystem::path& path, const Mesh& mesh);
Mesh read_mesh_archive(const std::filesystem::path& path, const Limits& limits = {});

/// The part that all frames of a sequence on disk share.
struct SequenceHeader {
  double fps = 0;              ///< frames per second, > 0
  std::vector<int> frame_ids;  ///< [N], the capture's own numbers, increasing, >= 0
  Mesh shared;                 ///< faces, uvs and uv faces of every frame; empty for scans
};

/// A sequence on disk is a folder: `sequence.h5` (schema "atelier.sequence": fps, frame ids, shared
/// topology) and one file per frame, `frames/000123.h5` (schema "atelier.mesh"; of a frame with
/// shared topology without faces and uvs). Frames may be written in any order, by several
/// processes; each appears whole or not at all. Folders are created 0700, files 0600.
///
/// Throws LogicError if the header breaks its conditions; reading one that does, DataError.
Archive archive_of(const SequenceHeader& header);
SequenceHeader sequence_header_of(Archive archive, const std::string& file = "",
                                  const Limits& limits = {});
void write_sequence_header(const std::filesystem::path& folder, const SequenceHeader& header);

/// Writes one frame. Throws DataError unless the mesh is valid and has the shared topology,
/// LogicError unless `frame_id` is one of the header's.
void write_sequence_frame(const std::filesystem::path& folder, const SequenceHeader& header,
                          int frame_id, const Mesh& mesh);

/// Writes header and frames of a sequence.
void write_sequence(const std::filesystem::path& folder, const Sequence& sequence);

SequenceHeader read_sequence_header(const std::filesystem::path& folder, const Limits& limits = {});

/// Opens a sequence: the header is read at once, each frame when asked for. A frame that is missing
/// or damaged, or has another number of vertices than the shared topology needs, is a DataError
/// from `load`.
Sequence open_sequence(const std::filesystem::path& folder, const Limits& limits = {});

/// "<folder>/frames/000123.h5".
std::filesystem::path sequence_frame_path(const std::filesystem::path& folder, int frame_id);

}  // namespace atelier
