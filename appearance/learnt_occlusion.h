#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "appearance/occlusion.h"

namespace atelier {

/// A network reproduces its training only from light transfer that is computed with the same
/// options: fewer rays have other noise, another reach has other light. Data and networks therefore
/// contain these options, and rendering uses them.

/// As texts by the names of their options: "occlusion.strata" and so on. None of nothing.
void put_occlusion(std::map<std::string, std::string>& texts,
                   const std::optional<OcclusionOptions>& occlusion);
/// And back; nothing where a file has none of them, as those of older programs. Throws DataError
/// where it has some of them, and for numbers out of range.
std::optional<OcclusionOptions> occlusion_at(const std::map<std::string, std::string>& texts,
                                             const std::string& file = "");

/// Left to the networks that draw: no strata, no reach, an offset below 0.
inline constexpr OcclusionOptions kOpenOcclusion = {0, 0, -1};
/// Its fields, each of which may be left open.
OptionTable describe_open(OcclusionOptions& options);

/// How a network learnt.
struct LearntOcclusion {
  std::string name;                           ///< of what it draws
  std::optional<OcclusionOptions> occlusion;  ///< nothing: nobody knows any more
};

/// "", or how options of which some are left open contradict a network: "occlusion.strata cannot be
/// 4: dress learnt with 8".
std::string occlusion_problem(const OcclusionOptions& asked, const LearntOcclusion& learnt);

/// Options of the light transfer of an image: those of its networks, where they have them, else
/// those asked for, else the defaults. Throws DataError where networks contradict each other or
/// what is asked.
OcclusionOptions drawn_occlusion(const OcclusionOptions& asked,
                                 const std::vector<LearntOcclusion>& learnt);

}  // namespace atelier
