#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/store/consent.h"

namespace atelier {

/// The file that a sealed archive begins with, and that stays in the folder it is unsealed to.
inline constexpr const char* kSealingNote = ".sealed.toml";

/// Metadata of a sealed archive, for those who can open it.
struct SealingNote {
  std::string kind;         ///< "workspace" or "export"
  std::string sealed;       ///< when: "2026-11-29T10:40:00Z"
  std::string purpose;      ///< one of kPurposes
  std::string none_needed;  ///< why no consent is needed; "" where there is one
  std::vector<Consent> consent;
  /// Of a workspace: every file of its current results was compared with its manifest's digest when
  /// it was sealed. Whoever opens it has those very bytes.
  bool digests_checked = false;
};

std::string sealing_note_text(const SealingNote& note);

/// Throws DataError for anything else than `sealing_note_text` writes.
SealingNote parse_sealing_note(std::string_view text, const std::string& file);

}  // namespace atelier
