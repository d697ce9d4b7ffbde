#pragma once

#include <cstdint>
#include <vector>

#include "core/finding.h"
#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

struct ColorSplitOptions {
  int clusters = 6;             ///< colours that the surface is sorted into, 2 to 16
  double skin_distance = 0.06;  ///< of chromaticity, that a colour may be from the face's, [0, 1]
  double head = 0.11;     ///< share of the stature that is head, whose skin sets the skin's colour
  double smoothness = 1;  ///< cost of a border between neighbours; 0: none
};
OptionTable describe(ColorSplitOptions& options);

/// Labels of a surface from its colours alone.
struct ColorSplit {
  std::vector<std::uint8_t> labels;  ///< [V] of Label: Skin, Hair, Upper, Lower, Dress, Shoes
  std::vector<Finding> findings;     ///< "labels-by-color" always; "skin-not-found"
};

/// Splits a standing person into skin and clothing where no label image says what is what: vertex
/// colours in Lab with little weight on lightness are clustered (k-means++ with a fixed seed, area
/// weighted), the head's most skin-like cluster is skin, and every cluster of nearly its
/// chromaticity. Other clusters are hair on the head, shoes on the lowest 6%, and clothing between:
/// one garment (Dress) if one cluster is most of it above and below the waist, else Upper and
/// Lower, each cluster by its height. Neighbours are smoothed (smooth_labels). A guess for captures
/// without labels: skin-coloured cloth is taken for skin, dark hair on dark skin too, and a print's
/// colours for garments'. Our choice throughout.
///
/// @param scan  with a colour for each vertex, Y up, standing. Throws LogicError without colours or
/// faces; DataError if it has fewer than 100 vertices.
ColorSplit split_by_color(const Mesh& scan, const ColorSplitOptions& options = {});

}  // namespace atelier
