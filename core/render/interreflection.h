#pragma once

#include "core/render/render.h"

namespace atelier {

struct BounceOptions {
  int rays = 32;       ///< from every vertex and lit side, [1, 65536]
  int light_rays = 4;  ///< to each area light from every vertex and lit side, [1, 256]
  int smoothings = 2;  ///< of what is gathered, over neighbouring vertices, [0, 100]
};

/// As `prepare`, and one bounce of light between the meshes is added to the environment's light at
/// every vertex: folds, armpits and the inside of a skirt are lit by the cloth and skin around
/// them, in their colours. The light that a surface reflects is its mean colour times the light
/// that falls on it from the lights (with shadows) and the environment, both per vertex; what
/// arrives is gathered by cosine-distributed rays (final gathering, Ward 1988, with radiosity per
/// vertex; our choice of one bounce). The ground's own light is that of `prepare`; meshes throw
/// none onto it.
///
/// `options.ambient` must be Ambient::PerVertex. Throws as prepare does, LogicError for options out
/// of range. O(vertices x (rays + lights x light_rays)) rays; the same bytes on any number of
/// threads.
PreparedScene prepare_with_bounce(const Scene& scene, const PrepareOptions& options,
                                  const BounceOptions& bounce = {},
                                  const PreparedTextures& textures = {});

}  // namespace atelier
