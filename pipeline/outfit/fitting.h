#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/human/default_human.h"
#include "core/garment.h"
#include "core/pose.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// The arms straight out to the sides, the rest as at rest: the pose that the patterns of
/// Garment-Pattern-Generator are made for. Throws DataError for a body that is no person.
Pose arms_out_pose(const BodyModel& body);

/// Patterns of GarmentCode lie round her mean body (assets/bodies/mean_all.yaml), which stands on
/// the ground. One that does, told by panels above the head of SMPL's woman, is moved to where it
/// would lie round her: what reaches to the shoulders by the shoulders, the rest by the hips.
void move_off_ground(SewingPattern& pattern);

/// Those patterns lie round the mean woman of SMPL, in metres from that body's origin, which is in
/// her trunk. Moves the panels to where they hang on another body with its arms out: what reaches
/// to the shoulders by the shoulders, skirts and trousers by the hips; front and back as far off
/// the trunk. `posed` are the body's vertices, arms out.
void place_round_body(Garment& panels, const BodyModel& body, const Points& posed);

/// Cut for the upper body: reaches above SMPL's armpits where it lies.
bool reaches_shoulders(const Garment& panels);

/// How wide cut panels are where a measure of the body is taken.
struct GirthFit {
  std::string measure;  ///< "chest_girth", "waist_girth", "hip_girth"
  double garment = 0;   ///< m, of all panels that the height cuts, sleeves left out
  double body = 0;      ///< m
};

/// Girths of panels placed round a body (they stand upright round it), where they reach. A height
/// between two panels that are sewn together takes the nearer edge.
std::vector<GirthFit> girth_fits(const Garment& panels, const BodyModel& body);

/// Cloth gives this much more than its girth: a girth that is tighter is refused (our choice).
constexpr double kGirthGive = 1.04;

/// The measures that are too tight, such as "chest_girth of 0.86 m on a body of 0.91 m"; "" if all
/// fits.
std::string what_is_tight(const std::vector<GirthFit>& fits);

/// The default human that the panels fit: of the same sex and stature with less mass, a kilogram at
/// a time, until the girths of such people are 3 cm less than the panels'. Throws DataError where
/// that would be no adult, or where fixed measures are in the way.
DefaultHumanOptions human_that_fits(const std::vector<GirthFit>& fits,
                                    const DefaultHumanOptions& human);

}  // namespace atelier
