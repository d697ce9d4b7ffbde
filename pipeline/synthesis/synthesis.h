#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/finding.h"
#include "pipeline/synthesis/synthesis_options.h"

namespace atelier {

/// Callbacks of a long synthesis.
struct SynthesisEvents {
  std::function<void(const std::string& line)> say;
  std::function<bool()> stop;  ///< true: end at the next image
};

/// Makes a synthetic capture in `folder` (docs/reference/formats.md): casts and dresses a subject,
/// simulates its cloth, photographs every frame, writes detections and truth. capture.toml comes
/// last, so that an interrupted capture does not look whole; called again with the same options it
/// goes on with what is missing and ends with the same bytes. Returns false if it was stopped.
///
/// Throws UsageError for a folder that holds something else or a capture of other options,
/// DataError for a subject, garment, motion or sequence that cannot be used, EnvironmentError for a
/// disk that is full, not writable, or in use by another run.
bool synthesize_capture(const std::filesystem::path& folder, const SynthesisOptions& options,
                        const SynthesisEvents& events);

/// Refuses what synthesize_capture refuses before it makes anything: a folder that holds something
/// else, names and files that cannot be used. Drapes nothing and writes nothing. Throws as that.
std::vector<Finding> require_synthesis(const std::filesystem::path& folder,
                                       const SynthesisOptions& options);

/// The options that a synthetic capture was made with. None where it does not say, or was made by a
/// version from which the same options give another capture.
std::optional<SynthesisOptions> synthesis_options_of(const std::filesystem::path& capture);

}  // namespace atelier
