#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/garment.h"
#include "simulation/material/stiffness_search.h"

namespace atelier {

/// A garment of material.json: its material, and how that was found unless it was given.
struct GarmentMaterial {
  std::string garment;
  Material material;
  std::optional<StiffnessFit> fit;
};

/// Of the range that is stated beside that of the search's band: a share of the least distance.
inline constexpr double kTenth = 0.1;

/// "1067", "2.4e-05".
std::string number_text(double value);
/// "464 to 10000 or more".
std::string range_text(const StiffnessRange& range);

/// The text of the stage's result, material.json: of each garment its material, how near its
/// simulation comes to where it was registered, the range of each stiffness that does as well, that
/// within a tenth of the nearest, the likely range, every trial.
std::string materials_text(const std::vector<GarmentMaterial>& garments);

/// A garment's material as it was found or given.
struct FoundMaterial {
  Material material;
  Stiffness credible_low;              ///< nine in ten are between this and
  Stiffness credible_high;             ///< this; both 0 where it was given
  std::vector<StiffnessTrial> trials;  ///< none where it was given
};

/// Materials of the garments, by their names, from the text or the stage's result. Throws DataError
/// for a file that is damaged.
std::map<std::string, FoundMaterial> parse_materials(std::string_view text,
                                                     const std::string& file = "");
std::map<std::string, FoundMaterial> read_materials(const std::filesystem::path& result);

}  // namespace atelier
