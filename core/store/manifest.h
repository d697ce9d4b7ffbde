#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/limits.h"
#include "core/sha256.h"
#include "core/store/consent.h"
#include "core/store/content_sketch.h"

namespace atelier {

/// One input of a stage, as it was when the stage ran.
struct ManifestInput {
  std::string kind;        ///< what it is: "meshes", "capture", ...
  std::string path;        ///< where it was; for people, no part of the key
  Digest digest{};         ///< of its files' names and bytes
  std::int64_t files = 0;  ///< how many
  std::int64_t bytes = 0;  ///< all together
  std::string stage;       ///< the stage that made it, "" if it came from outside
  Digest stamp{};  ///< of its files' names, sizes and times: where it is the same, so is the digest
  ContentSketch sketch{};  ///< of a folder from outside, to tell it again once it has changed
};

/// Whether two inputs of a kind are one and the same: by content, by place, or by most of their
/// files. So a capture may move, and may grow, lose files or be calibrated again, or both.
bool is_same_input(const ManifestInput& a, const ManifestInput& b);

/// In what two inputs differ that are not the same: "100 files, 40960 bytes there, 12 files, 4937
/// bytes here; of 64 files there that were compared 1 is here".
std::string input_difference(const ManifestInput& there, const ManifestInput& here);

/// "100 files, 40960 bytes".
std::string amount_text(std::int64_t files, std::int64_t bytes);

/// One option of a run.
struct ManifestOption {
  std::string name;
  std::string json;    ///< its value as JSON
  std::string source;  ///< "default", "flag" or "<file>:<line>"
  bool keyed = true;   ///< part of the key
};

/// One file that a stage made.
struct ManifestOutput {
  std::string path;       ///< inside the result's folder, with "/"
  std::int64_t size = 0;  ///< bytes
  Digest digest{};        ///< SHA-256 of its bytes
};

/// Warnings that a manifest holds; the last one then says how many more there were.
inline constexpr std::size_t kMaxWarnings = 1000;

/// Record of a finished stage: the file manifest.json. A result counts only if its manifest parses,
/// its key is the hash of what it says, and every output agrees with it.
struct Manifest {
  std::string stage;
  int stage_version = 0;
  std::string device;  ///< "cpu" or "cuda" for stages whose twins differ, else ""
  Digest key{};        ///< `stage_key` of the five that follow from the request
  std::vector<ManifestOption> options;
  std::string canonical_options;  ///< the keyed ones as `canonical_json` writes them
  std::vector<ManifestInput> inputs;
  std::vector<ManifestOutput> outputs;  ///< sorted by path
  std::vector<Consent> consent;         ///< of everything it was made from; empty: none recorded
  std::map<std::string, double> metrics;
  std::vector<std::string> warnings;  ///< what the stage found doubtful, at most kMaxWarnings
  std::string build;                  ///< version, compiler, kind of build
  std::string started;                ///< "2026-11-21T10:40:00Z"
  std::string finished;
  double work_seconds = 0;             ///< summed over frames, threads, shards and resumed runs
  std::int64_t peak_memory_bytes = 0;  ///< of the process that needed most, while it did this
};

/// SHA-256 of stage name, version, device, canonical options and inputs' kinds and digests: the
/// same work has the same key.
Digest stage_key(std::string_view stage, int stage_version, std::string_view device,
                 std::string_view canonical_options, const std::vector<ManifestInput>& inputs);

/// One digest of all outputs' paths and bytes: what a later stage takes as this result's digest, so
/// that work redone to the same bytes redoes nothing after it.
Digest outputs_digest(const Manifest& manifest);

/// First 16 digits of the key: the name of the result's folder.
std::string folder_name(const Digest& key);

/// True for paths that may stand in a manifest: relative, of [A-Za-z0-9._-] between single "/", no
/// part starting or ending with a dot, at most 1024 bytes.
bool is_safe_output_path(std::string_view path);

/// The text of manifest.json. Throws LogicError if a metric is not finite.
std::string manifest_text(const Manifest& manifest);

/// A manifest of a later schema: no damage, and nothing that this program may replace.
struct NewerManifestError : DataError {
  using DataError::DataError;
};

/// Reads what `manifest_text` writes, and what was written before there were warnings. Throws
/// NewerManifestError for a later schema, DataError for text that is damaged anywhere (it holds its
/// own digest), of another schema, with unsafe or colliding paths, with counts beyond `limits`, or
/// whose key is not the hash of what it says.
Manifest parse_manifest(std::string_view text, const std::string& file = "",
                        const Limits& limits = {});

}  // namespace atelier
