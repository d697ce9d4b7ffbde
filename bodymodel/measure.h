#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"

namespace atelier {

/// Density that turns a body's volume into mass, kg/m^3: tissue of 1060 (Drillis and Contini 1966)
/// with some 3 litres of air in the chest of a body of 70 litres.
constexpr double kBodyDensity = 1010;

/// Measurements of tailors and anthropometrists on a body that stands in its rest pose (arms out,
/// legs apart), metres and kilograms. Girths are convex, as a tape lies. Definitions follow ANSUR
/// II (Gordon et al. 2014) where a skeleton with SMPL's joint names can find the landmark; left and
/// right are averaged.
struct BodyMeasurements {
  double stature = 0;           ///< lowest to highest point
  double mass = 0;              ///< volume times kBodyDensity
  double leg_length = 0;        ///< ground to the crotch's lowest point in the middle plane
  double torso_length = 0;      ///< crotch to the height of the neck joint
  double arm_length = 0;        ///< acromion - elbow joint - wrist joint
  double shoulder_breadth = 0;  ///< between the acromia: skin over the shoulder joints, 30 degrees
                                ///< outward of straight up
  double neck_girth = 0;        ///< across the axis from neck to head joint, half way
  double chest_girth = 0;       ///< horizontal, at 0.63 of the height from pelvis to neck joint
  double waist_girth = 0;       ///< horizontal, at 0.33 of it
  double hip_girth = 0;         ///< horizontal, at the hip joints
  double thigh_girth = 0;       ///< across the thigh at 0.28 from hip to knee
  double upper_arm_girth = 0;   ///< across the arm half way from shoulder to elbow
  double calf_girth = 0;        ///< across the shank at 0.3 from knee to ankle
  double forearm_girth = 0;     ///< across the forearm at 0.25 from elbow to wrist
};

/// A measurement by name, so that lists of them need no second table.
struct NamedMeasurement {
  std::string name;
  std::string unit;
  double BodyMeasurements::*value;
};

/// All of them in the order of the struct.
const std::vector<NamedMeasurement>& measurement_names();

/// Measures a closed mesh with the joints of its skeleton at rest. Throws LogicError if the
/// skeleton lacks a joint that is needed (pelvis, neck, head, and on both sides hip, knee, ankle,
/// shoulder, elbow, wrist), DataError where a cut meets no closed outline round its bone, for trunk
/// or legs that do not stand upright and for a skin that is inside out. O(F).
BodyMeasurements measure_body(const Mesh& mesh, const Skeleton& skeleton);

/// Measures a model at a shape (empty: neutral); vertices of one place count as one, so that files
/// which split vertices at the seams of their atlas are measured too. Of a skin in several pieces
/// (eyes, teeth, lashes, hair) the one that holds at least four fifths of their volume is measured
/// alone; where none does, all are, and mass is 0: such skins enclose
/// some space twice. Throws DataError for one piece with openings larger than slits of eyes and
/// lips, and as above.
BodyMeasurements measure_body(const BodyModel& model, const Eigen::VectorXd& shape = {});

/// Signed volume of a closed mesh, m^3.
double mesh_volume(const Points& vertices, const Triangles& faces);

/// Length of the convex outline of the piece of a plane cut that encloses `origin`, metres; 0 if no
/// piece does. The plane goes through `origin`, `normal` has unit length.
double girth_at(const Points& vertices, const Triangles& faces, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& normal);

}  // namespace atelier
