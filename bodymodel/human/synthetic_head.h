#pragma once

#include "bodymodel/body_model.h"

namespace atelier {

/// Places on a head in the rest pose, for painting and dressing it.
struct HeadPlaces {
  Eigen::Vector3d eyes{0, 0, 0};   ///< middle between the eyes, on the surface
  double eye_distance = 0;         ///< m, between the eyes' centres
  Eigen::Vector3d top{0, 0, 0};    ///< highest point
  Eigen::Vector3d joint{0, 0, 0};  ///< of the head, at the base of the skull
  double front = 0, back = 0;      ///< z of the forehead and of the back of the head
  double half_width = 0;           ///< m, of the skull above the ears
  Eigen::Vector3f hair{0, 0, 0};   ///< colour of hair, linear RGB, drawn by the seed
  bool long_hair = false;          ///< over the ears down to the chin; drawn by the seed
};
HeadPlaces head_places(const BodyModel& body, std::uint64_t seed);

/// Metres that a place on the head lies above the hairline, which runs over the forehead, round
/// the ears (or before them, if hair is long) and down to the nape.
double above_hairline(const HeadPlaces& head, const Eigen::Vector3d& place);

}  // namespace atelier
