#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "registration/tracking/holding.h"

namespace atelier {

/// The file beside registered garments that says what holds them.
inline constexpr const char* kHoldingFile = "holding.toml";

/// Rings that hold garments on the body, as a TOML text that a person can edit
/// (docs/reference/formats.md): one table `[[held]]` for each ring.
std::string holding_text(const std::vector<HeldRing>& rings);

/// Reads such a text. A ring needs `garment`, `kind` and `vertices`; what is left out of the others
/// does not pull. Throws DataError for bad syntax, fields that there are not, a kind that is none,
/// fewer than two vertices or one twice, lengths outside 0 to 100 m and stiffnesses outside 0 to
/// 1e6 N.
std::vector<HeldRing> parse_holding(std::string_view text, const std::string& file = "");
std::vector<HeldRing> read_holding(const std::filesystem::path& path);

/// A garment that rings are for.
struct HeldGarment {
  std::string name;
  Index vertices = 0;
};

/// Throws DataError, naming the ring, for one of a garment that there is not, or of a vertex that
/// its garment does not have.
void require_holding(const std::vector<HeldRing>& rings, const std::vector<HeldGarment>& garments,
                     const std::string& file);

/// The rings of one garment.
std::vector<HeldRing> rings_of(const std::vector<HeldRing>& rings, const std::string& garment);

}  // namespace atelier
