#pragma once

#include <array>
#include <vector>

#include "core/types.h"

namespace atelier {

/// Where limbs end.
enum class Extremity { Head, LeftHand, RightHand, LeftFoot, RightFoot };
inline constexpr std::array kExtremities = {Extremity::Head, Extremity::LeftHand,
                                            Extremity::RightHand, Extremity::LeftFoot,
                                            Extremity::RightFoot};

/// The anatomy of a body for garments: which lump of flesh each vertex belongs to, and how lumps
/// follow one another from the pelvis to head, hands and feet. No skeleton, no skinning.
struct BodyAnatomy {
  std::vector<int> lumps;                 ///< [V] of each vertex of the body
  std::array<std::vector<int>, 5> limbs;  ///< lumps from the pelvis outwards, as kExtremities
};

/// Throws LogicError unless there is a lump for each of `vertices` and every limb has two lumps or
/// more, each with a vertex.
void check_anatomy(const BodyAnatomy& anatomy, Index vertices);

/// The direction that the body faces: a horizontal unit vector, perpendicular to that from right
/// hip and shoulder to the left ones. Zero where the latter is vertical, such as of a person lying
/// on the side.
Eigen::Vector3d body_facing(const BodyAnatomy& anatomy, const Points& body);

/// A line through the inside of the body, [N,3] m: from the pelvis through the middle of each lump,
/// and of the ring of edges between each two, to the tip of the limb.
Points limb_axis(const BodyAnatomy& anatomy, Extremity extremity, const Points& body,
                 const Triangles& faces);

/// How often a directed line goes through a closed loop: through the fan between loop and its
/// middle, +1 for each crossing to the side that the loop's left turns to (right-hand rule), -1 for
/// each the other way.
int crossings(const Points& loop, const Points& line);

/// The same with the fan's tip elsewhere than in the middle.
int crossings(const Points& loop, const Points& line, const Eigen::Vector3d& tip);

}  // namespace atelier
