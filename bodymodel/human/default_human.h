#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/measure.h"
#include "core/options.h"
#include "core/random.h"

namespace atelier {

/// The body to make. Measures left at 0 take the average of people of that sex, stature and mass.
struct DefaultHumanOptions {
  double male = 0.5;            ///< share, 0 female to 1 male: build, not size
  double stature = 0;           ///< metres
  double mass = 0;              ///< kilograms
  double leg_length = 0;        ///< metres, ground to crotch
  double torso_length = 0;      ///< metres, crotch to neck joint
  double arm_length = 0;        ///< metres, acromion to wrist
  double shoulder_breadth = 0;  ///< metres, between the acromia
  double neck_girth = 0;        ///< metres; girths as measure.h defines them
  double chest_girth = 0;
  double waist_girth = 0;
  double hip_girth = 0;
  double thigh_girth = 0;
  double upper_arm_girth = 0;
  bool correctives = true;  ///< pose correctives that keep volume; off makes a smaller model
  bool shape_basis = true;  ///< the 13 linear shape parameters round this body; off is faster
};
OptionTable describe(DefaultHumanOptions& options);

/// The error in the options, "" if there is none: a value out of its range.
std::string human_options_problem(const DefaultHumanOptions& options);

/// An average woman and man (docs/methods/default_human.md says of whom).
DefaultHumanOptions female_human();
DefaultHumanOptions male_human();

/// The measures of the options with the averages of sex, stature and mass where they are 0.
BodyMeasurements expected_measures(const DefaultHumanOptions& options);

/// Mass that the girths given (those above 0) speak for at the options' sex and stature, kilograms:
/// the most likely one when every girth and the mass have their spreads
/// (docs/methods/default_human.md); the average of sex and stature where no girth is given. `mass`
/// itself is not looked at, and 0 there takes this.
double likely_mass(const DefaultHumanOptions& options);

/// A body whose measures lie at percentiles (0.05 is the 5th) of their spreads at the measures that
/// they depend on: one for each of the twelve, stature and mass first, in the order of
/// DefaultHumanOptions. A body with girths above the average of its mass weighs more.
DefaultHumanOptions percentile_human(double male, const std::vector<double>& percentiles);

/// A body of the shape space: every measure uniform between two percentiles (5 and 95) of its
/// spread at the measures it depends on.
DefaultHumanOptions random_human(Random& random, double male, double low = 0.05,
                                 double high = 0.95);

/// A procedural adult in A-pose: 12k vertices, closed, two-manifold and mirror-symmetric
/// (left vertices follow the middle's, right ones follow in the same order), 55 joints with
/// SMPL-X's names and tree, smooth weights, volume-keeping pose correctives, joint limits, a UV
/// atlas whose islands are vertex groups "uv_*", and a linear shape space round the body in
/// physical units. The measures of its mesh (`measure_body`) are those asked for within
/// `kHumanMeasureError`. Made by our own code from anthropometric tables
/// (docs/methods/default_human.md): no licence gate.
///
/// Mass is the mesh's volume times `kBodyDensity`, girths are its girths: both are met, and what
/// the girths leave of the mass goes where no girth is taken. Throws LogicError for options out of
/// range (see `describe`) and DataError for measures that no adult has together: a body mass index
/// or a girth beyond the limits below, or no body found. Cost: about 0.5 s, most of it for the
/// shape basis.
BodyModel default_human(const DefaultHumanOptions& options = {});

/// Adults outside these body mass indices, kg/m^2, are refused.
constexpr double kMinMassIndex = 12;
constexpr double kMaxMassIndex = 60;

/// A girth or breadth further than this many spreads from what stature and mass predict is refused.
constexpr double kPlausibleSpreads = 8;

/// Largest relative error of a measure that `default_human` returns a body with.
constexpr double kHumanMeasureError = 0.002;

}  // namespace atelier
