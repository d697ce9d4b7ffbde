#pragma once

#include "core/mesh.h"

namespace atelier {

/// The vertices of a surface without what is finer than about six times `reach` metres: noise and
/// small creases, which no panel can lie flat with. Of all surfaces that are near, the one bent
/// least: minimises the integral of |x - vertices|^2 + reach^4 |laplacian x|^2 (core/laplacian.h);
/// a wave of length 2 pi reach keeps half its height. Rims are free, they have no laplacian, so
/// that openings are not drawn in. `reach` 0 changes nothing. After Botsch and Kobbelt, "An
/// intuitive framework for real-time freeform modeling", 2004.
///
/// Throws LogicError for a negative reach. One sparse Cholesky factorisation.
Points smoothed_surface(const Mesh& mesh, double reach);

}  // namespace atelier
