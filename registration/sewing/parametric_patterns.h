#pragma once

#include "core/options.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// Measures of a body for pattern making, and its position, so that panels can be placed round it.
/// Metres. The wearer looks to +Z, so that the left side is +X. Defaults: a woman of 1.68 m in an
/// A-pose.
struct TailorMeasures {
  double neck_girth = 0.36;
  double neckline = 0;  ///< half of its width, clear of the neck; 0: a sixth of the girth and 15 mm
  double ridge = 0;     ///< height over the ground of the shoulders at its ends; 0: unknown
  double chest_girth = 0.92;
  double waist_girth = 0.76;
  double hip_girth = 0.99;
  double upper_arm_girth = 0.29;
  double thigh_girth = 0.57;
  double shoulder_width = 0.38;  ///< between the shoulder points
  double back_length = 0.41;     ///< from the neck's base to the waist
  double waist_to_hip = 0.20;
  double inseam = 0.76;      ///< crotch to ankle
  double arm_length = 0.56;  ///< shoulder point to wrist

  Eigen::Vector3d neck_base = {0, 1.43, -0.03};
  Eigen::Vector3d waist = {0, 1.05, 0};
  Eigen::Vector3d hip = {0, 0.87, 0};
  Eigen::Vector3d left_shoulder = {0.18, 1.38, -0.02};
  Eigen::Vector3d left_wrist = {0.55, 0.95, 0};
  Eigen::Vector3d right_shoulder = {-0.18, 1.38, -0.02};
  Eigen::Vector3d right_wrist = {-0.55, 0.95, 0};
  Eigen::Vector3d left_ankle = {0.11, 0.08, 0};
  Eigen::Vector3d right_ankle = {-0.11, 0.08, 0};
};

struct TeeOptions {
  double ease = 0.10;         ///< m added to the chest girth
  double length = 0.18;       ///< m below the waist
  double sleeve = 0.35;       ///< share of the arm that the sleeve covers
  double sleeve_ease = 0.08;  ///< m added to the upper arm's girth
  double neck_depth = 0.09;   ///< m below the neck's base in front
};
OptionTable describe(TeeOptions& options);

struct SkirtOptions {
  double length = 0.55;  ///< m from the waist down
  double flare = 0.9;    ///< rad that front and back each open: 0.2 straight, 1.57 half a circle
  double ease = 0.02;    ///< m added to the waist girth
};
OptionTable describe(SkirtOptions& options);

struct DressOptions {
  TeeOptions bodice = {.ease = 0.06, .length = 0, .sleeve = 0.2};
  SkirtOptions skirt = {.length = 0.6, .flare = 1.4, .ease = 0.06};
};
OptionTable describe(DressOptions& options);

struct TrousersOptions {
  double ease = 0.06;     ///< m added to the hip girth
  double opening = 0.36;  ///< m round each hem
  double rise = 0.25;     ///< m from crotch to waist
};
OptionTable describe(TrousersOptions& options);

/// Front, back and two sleeves. The sleeve cap is drafted so that its length equals the armhole's.
/// Our choice of draft, after the basic blocks of Aldrich, "Metric Pattern Cutting".
/// All four throw LogicError if measures or options make no garment (no width left, no length).
SewingPattern tee_pattern(const TailorMeasures& measures, const TeeOptions& options = {});

/// Front and back, each a sector of a ring.
SewingPattern skirt_pattern(const TailorMeasures& measures, const SkirtOptions& options = {});

/// A fitted bodice with sleeves and a loose skirt sewn to it at the waist.
SewingPattern dress_pattern(const TailorMeasures& measures, const DressOptions& options = {});

/// Four legs: front and back, left and right.
SewingPattern trousers_pattern(const TailorMeasures& measures, const TrousersOptions& options = {});

}  // namespace atelier
