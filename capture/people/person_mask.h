#pragma once

#include "capture/detection/find_people.h"
#include "core/image.h"
#include "core/options.h"

namespace atelier {

struct PeopleMaskOptions {
  double threshold = 0.5;  ///< probability from which a pixel is a person's, (0, 1)
  double reach = 4;        ///< pixels of the network's mask over which borders are moved, [0, 16]
  double edge = 0.02;      ///< difference of gamma-coded values that is a border, (0, 1]
  double min_part = 0.05;  ///< parts smaller than this share of the largest go, [0, 1]
};
OptionTable describe(PeopleMaskOptions& options);

/// 255 where the built-in detector sees one of the people, 0 elsewhere. Its masks have 256 x 256
/// pixels a crop: they are brought to the image's pixels and moved to the image's own borders by a
/// guided filter (He et al. 2013, over each crop's scale).
/// @param image  [H,W,1|3] that the people were found in
/// Throws LogicError for other images.
ByteImage people_mask(const PeopleInImage& people, const ByteImage& image,
                      const PeopleMaskOptions& options = {});

}  // namespace atelier
