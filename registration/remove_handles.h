#pragma once

#include "core/mesh.h"

namespace atelier {

/// A surface cut open where parts of it are bridged.
struct CutHandles {
  Mesh mesh;    ///< positions and faces alone where something was cut
  int cut = 0;  ///< loops that it was cut along, each of which leaves two boundary loops
};

/// A garment is a sphere with openings. A handle of its surface is a bridge between two places that
/// lie close together, as two legs where no camera sees between them, round which no isotropic
/// triangles fit without one being turned over. The surface is cut along the shortest loop of edges
/// that goes round a handle or through it, and again until none is left of `longest` metres or
/// less. Closed over both sides of the cut (isotropic_remeshing) there is a handle less.
///
/// Loops that part the surface, as round a sleeve, go round no handle; nor does what an opening
/// ends. That is asked of parities: an edge has a bit for each loop of a basis of the surface, all
/// openings closed, that says whether it crosses that loop (tree and cotree: Eppstein, "Dynamic
/// generators of topologically embedded graphs", 2003); a loop that parts the surface crosses each
/// evenly. Loops keep off the rims, and off vertices where parts of the surface only touch. Of
/// surfaces with more than 32 handles those beyond stay.
///
/// Throws LogicError for edges of three faces or of opposite orientation, and for faces with a
/// vertex twice. O(V x edges within half of `longest`) for each cut.
CutHandles remove_handles(Mesh mesh, double longest);

}  // namespace atelier
