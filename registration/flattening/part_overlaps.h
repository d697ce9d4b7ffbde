#pragma once

#include <functional>
#include <vector>

#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// The cut, and further cuts through those panels of its pattern that lie over themselves.
///
/// Of two triangles that lie over each other (flat_overlaps.h) each is to be in another panel: what
/// of the panel is nearer to one of them, along the surface, is parted from what is nearer to the
/// other; and so on, until no two of those that lie over each other are together. Panels that are
/// no disks then are opened (cut_to_disks.h). Panels that only touch themselves, without two
/// triangles over each other, are parted in their middle. Our choice.
///
/// `pattern` is flatten_surface's of this mesh and cut. Throws LogicError for other numbers.
std::vector<char> cut_where_overlapping(const Mesh& mesh, const std::vector<char>& cut,
                                        const FlatPattern& pattern);

/// flatten_surface, and panels that lie over themselves parted (cut_where_overlapping) and laid
/// flat again until none does: in what is returned `overlapping` is empty whatever the surface. It
/// ends, since every time some panel becomes two with fewer triangles, and one triangle alone lies
/// flat. `parted` hears how many panels are about to be.
FlatPattern flatten_apart(const Mesh& mesh, std::vector<char> cut,
                          const FlattenOptions& options = {},
                          const std::function<void(std::size_t panels)>& parted = {});

}  // namespace atelier
