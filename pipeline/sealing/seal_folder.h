#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/seal/age_header.h"
#include "core/seal/packed_folder.h"
#include "pipeline/sealing/sealing_note.h"

namespace atelier {

/// A sealed file that was written.
struct SealedFolder {
  PackedFolder packed;
  std::int64_t bytes = 0;  ///< of the file
};

/// Seals a folder into a new file, which appears whole or not at all: not where `stop` said so, and
/// not where `before_commit` throws, which is called once everything is written.
SealedFolder seal_folder(const std::filesystem::path& folder, const SealingNote& note,
                         const AgeRecipients& to, const std::filesystem::path& out,
                         const std::function<bool()>& stop,
                         const std::function<void()>& before_commit);

/// "for research, to age1...": what the log says of it.
std::string sealed_to_text(const AgeRecipients& to, const std::string& purpose);

}  // namespace atelier
