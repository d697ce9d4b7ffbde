#pragma once

#include <string>
#include <vector>

#include "capture/fabric.h"
#include "capture/label_taxonomy.h"
#include "core/io/ground_truth_archive.h"
#include "core/render/scene.h"
#include "pipeline/synthesis/synthetic_subject.h"

namespace atelier {

/// Something that a body wears and that moves as its skin does: hair, shoes.
struct WornLayer {
  std::string name;
  BodyModel model;  ///< the body's skeleton, its own surface and weights
  Look look;
  Label label = Label::Other;
  bool in_minimal = false;  ///< worn in the minimal sequence too
};

/// A cap of hair over the scalp, some with a knot: the scalp's triangles, refined and lifted.
WornLayer hair_cap(const BodyModel& body, std::uint64_t seed);

/// A pair of plain shoes with soles of `kSoleHeight`: the feet's triangles, smoothed and lifted.
WornLayer plain_shoes(const BodyModel& body, std::uint64_t seed);
inline constexpr double kSoleHeight = 0.014;  // m, below the bare foot

/// Skin in the colour of a person drawn by `seed`, darker and redder where people are, with lips,
/// brows and painted eyes, and tight minimal clothing (shorts and a top). A texture of `resolution`
/// where the body has uvs, else colours per vertex, which are put on `mesh`.
Look skin_look(const BodyModel& body, Mesh& mesh, int resolution, std::uint64_t seed);

/// Cloth as the eye sees it: `albedo` is on the garment's uvs.
Look cloth_look(const Image& albedo, FabricKind kind);

}  // namespace atelier
