#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/store/consent.h"

namespace atelier {

inline constexpr std::string_view kDrawnByNetworks = "trained networks";
inline constexpr std::string_view kDrawnNormals = "normals of surfaces";
inline constexpr std::string_view kDrawnPlain = "shaded surfaces";

/// What a drawn image says of itself: whose consent it rests on and what it was made of.
struct RenderStatement {
  std::string tool;     ///< `drawing_tool`
  std::string drawn;    ///< by what: kDrawnByNetworks, kDrawnNormals or kDrawnPlain
  std::string purpose;  ///< one of kPurposes
  std::vector<Consent> consent;
  /// Stage and SHA-256 of its result's manifest, which has the digests of all that it was made of.
  std::vector<std::pair<std::string, std::string>> made_of;
};

/// This program, "atelier 0.1.0".
std::string drawing_tool();

/// The statement as JSON, always the same text.
std::string render_statement_text(const RenderStatement& statement);

/// Throws DataError for anything else than `render_statement_text` writes.
RenderStatement parse_render_statement(std::string_view text, const std::string& file);

/// The 64 bits that images of a statement are marked with: the first of its text's SHA-256.
std::uint64_t mark_of(const RenderStatement& statement);

/// 16 hexadecimal digits.
std::string mark_text(std::uint64_t mark);

}  // namespace atelier
