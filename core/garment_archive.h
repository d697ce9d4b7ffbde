#pragma once

#include <filesystem>
#include <string>

#include "core/archive.h"
#include "core/garment.h"

namespace atelier {

/// A garment as an archive of schema "atelier.garment", version 1 (docs/reference/formats.md), and
/// back. Empty arrays of the garment are not written. Throws DataError unless the garment is valid
/// (check_garment).
Archive archive_of(const Garment& garment);
Garment garment_of(const Archive& archive, const std::string& file = "");

void write_garment_archive(const std::filesystem::path& path, const Garment& garment);
Garment read_garment_archive(const std::filesystem::path& path, const Limits& limits = {});

/// Parts of a garment that other archives hold too, inside a group "<group>/".

/// Mesh, flat pattern and material: "<group>/vertices", "<group>/pattern/rest",
/// "<group>/material/values", ... Back, it throws DataError unless the garment is valid; it has no
/// name, seams, boundaries or attachments.
void put_cloth(Archive& archive, const std::string& group, const Garment& garment);
Garment cloth_at(const Archive& archive, const std::string& group, const std::string& file);

/// Seams as "<stem>s" [N,3] (seam, vertex of a, vertex of b) and "<stem>_names"; back, every vertex
/// is one of `vertices`.
void put_seams(Archive& archive, const std::string& stem, const std::vector<Seam>& seams);
std::vector<Seam> seams_at(const Archive& archive, const std::string& stem, Index vertices,
                           const std::string& file);

}  // namespace atelier
