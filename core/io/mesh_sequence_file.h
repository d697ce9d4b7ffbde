#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/io/polygon_mesh.h"
#include "core/limits.h"
#include "core/sequence.h"
#include "core/tensor.h"

namespace atelier {

/// A sequence of meshes in a file of another program, with what it says of the person.
struct MeshSequenceFile {
  Sequence sequence;               ///< over one topology
  Mesh shared;                     ///< faces, uvs and labels of every frame
  std::vector<std::string> names;  ///< [J] of joints, or empty
  std::vector<int> parents;        ///< [J], or empty
  std::vector<Points> joints;      ///< [F] of [J,3] metres, or empty
};

/// Whose meshes a sequence has.
enum class SequenceOf {
  Person,  ///< a body of 0.5 to 2.5 m, metres, Y up
  Body,    ///< anything that cloth lies on
  Cloth,
};

/// Reads a folder of meshes (.obj, .ply, ... one a frame, read_sequence_folder; what `export` wrote
/// of a registered garment with its template beside the frames, too), a folder of ours
/// (sequence.h5), binary USD (usd_mesh.h), or a file (.npz, .h5, .hdf5) with `vertices` [F,V,3]
/// metres Y up, `faces`, and optional `uv` [V,2], `fps`, `labels` [V], `joints` [F,J,3],
/// `joint_names`, `joint_parents`. A file without `vertices` may have body and cloth beside each
/// other: `body_vertices`, `body_faces` and `body_uv`, or `cloth_vertices`, .... Joints without
/// names are "joint_0", .... Throws DataError for frames of different topologies, arrays that are
/// missing, of another shape, not finite or beyond Limits::mesh_coordinate, and a person who is not
/// 0.5 to 2.5 m tall (units are metres). `otherwise` is the unit and up axis of files in a folder
/// that do not say theirs.
MeshSequenceFile read_mesh_sequence(const std::filesystem::path& path, SequenceOf what,
                                    const Limits& limits = {},
                                    const MeshConvention& otherwise = {.metres_per_unit = 1,
                                                                       .up = 'y'});

/// The same of the arrays of such a file, by their names.
MeshSequenceFile mesh_sequence_of(const std::map<std::string, Tensor>& arrays,
                                  const std::string& file = "", const Limits& limits = {});

}  // namespace atelier
