#pragma once

#include "core/types.h"

namespace atelier {

/// The faces, turned so that neighbours agree on what is outside: of every piece that is joined by
/// edges of two faces, those that disagree with the greater part (by number) are turned round. A
/// surface that cannot agree (a Moebius strip) keeps some edges where it does not. Throws
/// LogicError for a face that names no vertex. O(F log F).
Triangles consistently_oriented(const Triangles& faces, Index vertex_count);

}  // namespace atelier
