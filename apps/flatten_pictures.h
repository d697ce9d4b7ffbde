#pragma once

#if defined(ATELIER_HAS_REGISTRATION) && defined(ATELIER_HAS_CORE_RENDER)

#include "core/image.h"
#include "core/mesh.h"
#include "registration/flat_pattern.h"

namespace atelier {

/// The surface from four sides and its flat panels, each triangle in the colour of its stretch.
/// Linear RGB.
Image stretch_picture(const Mesh& mesh, const FlatPattern& pattern, const FlatMeasures& measures);

}  // namespace atelier

#endif
