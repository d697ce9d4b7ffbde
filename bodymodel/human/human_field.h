#pragma once

#include "bodymodel/human/human_anatomy.h"

namespace atelier {

/// The body as the inside of a field: the tubes of its anatomy, a head, hands and feet of cones and
/// sections, joined by smooth minima.
struct HumanField {
  HumanAnatomy anatomy;
  HumanTube head, palm, foot;
  std::vector<HumanCone> fingers, toes;
  std::vector<HumanCone> knuckles;  ///< and the balls of the palm
};

HumanField human_field(const HumanAnatomy& anatomy);

/// Roughly the distance to the skin in metres, negative inside; symmetric in x. Exact at zero only:
/// far away it is no more than a bound that is good enough to find the zero set.
double field_value(const HumanField& field, Vec3d p);

/// Parts of the left half, as `part_distances` lists them.
enum class HumanPart { Trunk, Leg, Arm, Head, Hand, Foot };
constexpr std::size_t kHumanParts = 6;

/// Rough distance of a point with x >= 0 to each part alone; a large number for parts that are far.
std::array<double, kHumanParts> part_distances(const HumanField& field, Vec3d p);

/// The point of the trunk as it was before (sign -1) or as it is after (+1) its swellings.
Vec3d with_bumps(const HumanAnatomy& anatomy, Vec3d p, double sign);

/// Unit outward direction of steepest ascent (central differences of 0.2 mm).
Vec3d field_normal(const HumanField& field, Vec3d p);

/// The point moved onto the zero set along the gradient.
Vec3d field_project(const HumanField& field, Vec3d p);

}  // namespace atelier
