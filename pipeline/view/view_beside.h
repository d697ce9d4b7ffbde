#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "pipeline/view/view_scene.h"

namespace atelier {

/// The last names of two places, with as many of the folders around them as it takes to tell them
/// apart: "monday/walk" and "tuesday/walk". One place is told by its number: "walk (1)".
std::array<std::string, 2> names_apart(const std::filesystem::path& first,
                                       const std::filesystem::path& second);

/// Two scenes as one, the second beside the first.
/// @param names  of each
void put_beside(ViewScene& scene, ViewScene other, const std::array<std::string, 2>& names);

}  // namespace atelier
