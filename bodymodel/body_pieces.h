#pragma once

#include "core/types.h"

namespace atelier {

/// The pieces of a skin that belong to the body.
struct MainPiece {
  Triangles faces;  ///< of the pieces taken; vertices of one place are one
  int pieces = 1;   ///< taken: 1, or all where none holds most of the volume
};

/// Tells a body from eyes, teeth, lashes and hair: pieces hang together by vertices of one place
/// (files split vertices at the seams of their atlas), and the one that holds at least four fifths
/// of the volume of all is the body. Where none does (a dressed figure, a skin cut into parts), all
/// are taken. The share is our choice. O(V log V + F log F).
MainPiece main_piece(const Points& vertices, const Triangles& faces);

}  // namespace atelier
