#pragma once

#include "bodymodel/body_model.h"

namespace atelier {

/// The body with vertices joined that a file has split, because glTF and FBX give a vertex one
/// texture coordinate: texture coordinates stay per corner (uvs, uv_faces). Open edges are joined
/// in pairs, where exactly two lie on each other, run against each other, and agree at both ends in
/// position, weights and shape offsets to the last bit; so skins that only touch, such as closed
/// lips, stay apart. A vertex keeps the number of the first of those it is made of, less the gaps.
/// Throws LogicError for a model with correctives, a regressor or groups, which name vertices.
/// O(F log F).
BodyModel without_seams(BodyModel model);

}  // namespace atelier
