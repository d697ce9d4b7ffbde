#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "core/io/polygon_mesh.h"
#include "core/limits.h"

namespace atelier {

/// Reads PLY 1.0 (Turk 1994), ascii or binary of either byte order, with properties of any type.
/// Vertices: x y z; nx ny nz; red green blue (also r g b and diffuse_*; uchar, ushort, or float in
/// [0,1]; sRGB); s t, u v or texture_u texture_v; label; confidence. Faces: vertex_indices or
/// vertex_index; texcoord (corners). Everything else is skipped, after its bytes have been counted.
/// Equal texture coordinates at one vertex become one. Confidence is clamped to [0,1] and normals
/// without a direction are dropped, each with a finding.
/// Throws DataError: a count that the remaining bytes cannot pay, a number that is none or not
/// finite, an index out of range, a label beyond 0..255, a face of fewer than 3 or more than 1024
/// corners, triangle strips, bytes left over, a coordinate or a count beyond the limits.
PolygonMesh read_ply(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits = {});
PolygonMesh read_ply(const std::filesystem::path& path, const Limits& limits = {});

enum class PlyFormat { Ascii, BinaryLittleEndian, BinaryBigEndian };

struct PlyOptions {
  PlyFormat format = PlyFormat::BinaryLittleEndian;
  /// Coordinates as double and colours as float, so that what is read back is the same (positions
  /// bit for bit, colours to 1e-6). Off: float and uchar, which every viewer reads.
  bool exact = false;
};

/// A PLY file with the comments "units: m" and "up: y". Texture coordinates go to the vertices
/// where each has just one, else to the corners. Names of groups and materials have no place in
/// PLY. Throws LogicError if the mesh is inconsistent, DataError for a number that a float does not
/// hold.
std::string ply_bytes(const PolygonMesh& mesh, const PlyOptions& options = {});

/// `ply_bytes` into a file, replaced as a whole. Throws EnvironmentError if it cannot be written.
void write_ply(const std::filesystem::path& path, const PolygonMesh& mesh,
               const PlyOptions& options = {});
void write_ply(const std::filesystem::path& path, const Mesh& mesh, const PlyOptions& options = {});

}  // namespace atelier
