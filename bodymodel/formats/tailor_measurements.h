#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bodymodel/human/default_human.h"
#include "core/finding.h"
#include "core/limits.h"

namespace atelier {

/// Measurements of one person as a tailor takes them.
struct TailorMeasurements {
  std::string file;
  std::string unit;                       ///< of the file: "mm", "cm" or "inch"
  std::map<std::string, double> lengths;  ///< metres, by the file's names: "bust_circ"
  std::vector<Finding> findings;
};

/// Reads individual measurements of Valentina (.vit) and Seamly2D (.smis): XML in mm, cm or inches.
/// Values are numbers or formulas of + - * / ^ and parentheses over other measurements; one of
/// another kind (functions, a measurement that is not there, a circle) is left out with a finding
/// ("measurement-formula"), and so is 0, without one: programs write it for what was not taken.
///
/// Throws DataError, with the line, for text that is no XML, another root (of a table of sizes with
/// advice), no measurement at all, a unit that is none of the three, a measurement without name or
/// value or of a name that is there twice, and lengths that are not finite or beyond 100 m.
TailorMeasurements parse_tailor_measurements(std::string_view text, const std::string& file,
                                             const Limits& limits = {});
TailorMeasurements read_tailor_measurements(const std::filesystem::path& path,
                                            const Limits& limits = {});

/// Whether a file's name says that it holds such measurements, or a table of sizes (.vst, .smms),
/// which reading refuses with what to do.
bool has_measurements_extension(const std::string& file);

/// The first of these measurements that is beyond what a body here can have, with the file's unit:
/// "height is 0.705 m, in cm as the file says: stature cannot be ..."; "" if there is none.
std::string unlikely_measurement(const TailorMeasurements& measurements);

/// The body with those of the measurements that it knows by the same definition: height,
/// leg_crotch_to_floor, arm_shoulder_tip_to_wrist, width_shoulder, neck_mid_circ, bust_circ,
/// waist_circ, hip_circ and leg_thigh_upper_circ. Others stay as `human` has them: Valentina
/// measures neck_circ at the base of the neck and arm_upper_circ at the armpit. A finding
/// ("measurements-taken") says which were. Throws DataError for one that no adult has, as where a
/// file of inches says cm (unlikely_measurement).
DefaultHumanOptions with_measurements(DefaultHumanOptions human, TailorMeasurements& measurements);

}  // namespace atelier
