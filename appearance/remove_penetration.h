#pragma once

#include "core/types.h"

namespace atelier {

/// Skin under the cloth that is worn over it, for images: where cloth lies inside the body, up to
/// `reach` metres deep and facing as the skin does, the skin's vertices are moved to 3 mm under it;
/// every other vertex stays. Cloth beyond the body's other side does not count, so that a hand
/// which rests on cloth stays where it is. Where a captured garment was registered into the body,
/// the body would be seen through it. Our choice.
///
/// @param skin    [V,3] metres, closed surface with faces [F,3]
/// @param cloth   [C,3] metres, all that is worn, with faces [G,3]
/// Throws LogicError as build_tree does. O((V + F) log(F + G)).
Points remove_penetration(const Points& skin, const Triangles& skin_faces, const Points& cloth,
                          const Triangles& cloth_faces, double reach);

}  // namespace atelier
