#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// Content of an HDF5 archive of Atelier: a schema with its version, the unit and up axis of
/// everything in it, numbers and texts, and named arrays.
struct Archive {
  std::string schema;                        ///< what it is, e.g. "atelier.mesh"
  int version = 1;                           ///< of the schema
  std::string units = "m";                   ///< of lengths
  std::string up_axis = "y";                 ///< "x", "y" or "z"
  std::map<std::string, double> numbers;     ///< finite
  std::map<std::string, std::string> texts;  ///< UTF-8
  std::map<std::string, Tensor> datasets;    ///< rank 1 to 8; "group/name" makes groups
};

/// Writes an archive whole or not at all (AtomicFile), after it has been read back and found equal.
///
/// The file is plain HDF5 that h5py opens with no help: datasets are chunked with a Fletcher-32
/// checksum each, schema, version, units, up axis, numbers and texts are attributes of the root.
/// Every call of HDF5 is checked, H5Fflush, H5Dclose and H5Fclose too: on a full disk H5Fclose
/// alone reports success. In the user block before the HDF5 part stands an index (schema, names,
/// types, shapes, where each chunk lies) and the SHA-256 of everything after it; read_archive uses
/// that. The same archive gives the same bytes.
///
/// Allowed element types are bool, integers, float32, float64 and Text (without NUL). Names consist
/// of letters, digits, "_", "-", ".", in datasets also "/". Anything else, rank 0 (scalars are
/// numbers) and numbers that are not finite are LogicError. A failing disk is EnvironmentError.
void write_archive(const std::filesystem::path& path, const Archive& archive);

/// Reads an archive of `schema`, version 1 to `newest_version`.
///
/// HDF5's own reader is not safe on hostile files, so that it is not used: the SHA-256 in the user
/// block is compared first, then every chunk is read from where the index says, each inside the
/// file, none overlapping another, so that no archive takes more memory than it has bytes.
/// DataError if the file is damaged in any bit, no archive of Atelier, or of another schema or
/// version.
Archive read_archive(const std::filesystem::path& path, const std::string& schema,
                     int newest_version, const Limits& limits = {});

/// The same from memory. @param file  name for errors
Archive parse_archive(std::span<const std::byte> bytes, const std::string& schema,
                      int newest_version, const std::string& file = "", const Limits& limits = {});

/// Content of an archive of any schema: datasets have types and shapes, but no data. Only the index
/// is read and the digest is not compared; for showing to people.
Archive archive_contents(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
