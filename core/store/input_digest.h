#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/sha256.h"
#include "core/store/content_sketch.h"
#include "core/store/digest_meter.h"
#include "core/store/stage.h"

namespace atelier {

/// Size and SHA-256 of a regular file. Throws DataError if it is missing, a symbolic link or no
/// regular file, EnvironmentError if the disk fails; StopRequested as the meter says, which is
/// asked for every MiB. Cost: reads the file.
struct FileDigest {
  std::int64_t size = 0;
  Digest digest{};
};
FileDigest digest_of_file(const std::filesystem::path& path, DigestMeter& meter);
FileDigest digest_of_file(const std::filesystem::path& path);

/// Digest of a file or a folder, which changes with any name or byte.
struct InputDigest {
  Digest digest{};
  std::int64_t files = 0;
  std::int64_t bytes = 0;
  Digest stamp{};          ///< of names, sizes and times alone: cheap to take again
  ContentSketch sketch{};  ///< of a folder's files
};

/// Whether consent that is stated inside of an input counts as its content.
enum class ConsentPart {
  Apart,  ///< not: renewing it redoes no work, manifests carry it beside the key
  Keyed,  ///< it does, with what is stated beside the input: for results that speak of it
};

/// That of the INPUT of a stage.
inline ConsentPart consent_part(const Stage& stage) {
  return stage.states_consent ? ConsentPart::Keyed : ConsentPart::Apart;
}

/// Digest of one file, or of every file below a folder by its relative path in sorted order; names
/// that start with a dot are left out. With `ConsentPart::Apart` a folder's own `consent.toml` is
/// left out too, and the tables [consent] and [[consent]] of its own `capture.toml` (not where that
/// has strings of several lines, which might look like tables). Symbolic links are followed, as if
/// what they lead to lay there; those that lead nowhere or in a circle are refused. Tells its
/// progress to `events` and throws StopRequested if `events.stop` says so; throws DataError. Cost:
/// reads every file, on several threads.
InputDigest digest_of_input(const std::filesystem::path& path, const StageEvents& events = {},
                            ConsentPart consent = ConsentPart::Apart);

/// The stamp alone, without reading any file (but what states consent, where it is keyed): tells
/// whether an input changed while it was used.
Digest stamp_of_input(const std::filesystem::path& path, ConsentPart consent = ConsentPart::Apart);

/// A TOML text without its tables [consent] and [[consent]]; the whole of it where it has none, or
/// strings of several lines.
std::string without_consent(std::string_view toml);

}  // namespace atelier
