#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "bodymodel/body_model.h"
#include "core/limits.h"
#include "core/options.h"

namespace atelier {

/// MakeHuman works in decimetres.
inline constexpr double kMetresPerMakeHumanUnit = 0.1;

/// Reads a MakeHuman .target: lines "vertex dx dy dz" in decimetres, '#' comments. A target without
/// lines is valid (the "average" ones are). Offsets in metres; a vertex named twice is added up.
/// Throws DataError, with the line, for a vertex out of [0, base_vertices), a number that is not
/// finite, or more or fewer words in a line.
Blendshape read_target(std::span<const std::byte> bytes, const std::string& name,
                       Index base_vertices, const Limits& limits = {});
Blendshape read_target(const std::filesystem::path& path, Index base_vertices,
                       const Limits& limits = {});

/// How much each macro slider is moved, as in MakeHuman: all in [0,1].
struct MakeHumanMacros {
  double gender = 0.5;       ///< 0 female, 1 male
  double age = 0.5;          ///< 0 baby, 0.1875 child, 0.5 young adult (25 years), 1 old
  double muscle = 0.5;       ///< 0.5 average
  double weight = 0.5;       ///< 0.5 average
  double height = 0.5;       ///< 0.5 average
  double proportions = 0.5;  ///< 0 uncommon, 1 ideal
  double african = 1.0 / 3;  ///< the three share 1
  double asian = 1.0 / 3;
  double caucasian = 1.0 / 3;
};

OptionTable describe(MakeHumanMacros& macros);

/// One macro target and its share.
struct MacroTarget {
  std::string name;  ///< path below the folder "macrodetails", without ".target"
  double weight = 0;
};

/// The macro targets that sliders blend, by MakeHuman's rule: every slider is split into its
/// anchors (linear between neighbours), and a target weighs the product of the anchors in its name.
/// Targets of weight 0 are left out. Throws LogicError for sliders out of [0,1] or shares that do
/// not sum to 1.
std::vector<MacroTarget> macro_targets(const MakeHumanMacros& macros);

}  // namespace atelier
