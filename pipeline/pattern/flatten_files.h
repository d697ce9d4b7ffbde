#pragma once

#include <string>
#include <vector>

#include "pipeline/pattern/flatten_garment.h"

namespace atelier {

/// A file that is written of a flattened garment.
struct FlattenFile {
  std::string name;   ///< "pattern.svg"
  std::string bytes;  ///< its content
};

/// The pattern as pattern.svg, pattern.dxf, pattern_astm.dxf, pattern_aama.dxf, pattern.pdf,
/// pattern.val (Valentina) and pattern.json (GarmentCode), the flattened mesh as garment.obj, and,
/// where the pattern was sewn anew, sewn.obj; with pictures stretch.png and sewn.png.
/// @param options  by which it was flattened
std::vector<FlattenFile> flatten_files(const FlattenedGarment& flat, const std::string& title,
                                       const FlattenStageOptions& options, bool pictures);

}  // namespace atelier
