#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/human/human_template.h"

namespace atelier {

/// Texture coordinates of the whole template.
struct HumanAtlas {
  Points2 uvs;                       ///< [T,2] in the unit square
  Triangles uv_faces;                ///< [F,3] into uvs
  std::vector<VertexGroup> islands;  ///< "uv_face", "uv_left_arm", ...: vertices of each island
};

/// Lays the body out as islands: face and back of the head, front and back of the torso, and for
/// each side arm, back of the hand, palm, leg, upper foot and sole. Limbs are cut along their inner
/// sides. `faces` are all triangles, the left half's first.
HumanAtlas human_atlas(const HumanTemplate& body, const Triangles& faces);

}  // namespace atelier
