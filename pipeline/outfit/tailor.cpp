#include "pipeline/outfit/tailor.h"

#include <algorithm>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/measure.h"
#include "core/error.h"

namespace atelier {
namespace {

/// Calls `at` with every point in which edges of the surface meet the plane where `axis` is
/// `value`.
template <class Visit>
void for_section(const Mesh& mesh, int axis, double value, const Visit& at) {
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const Eigen::RowVector3d a = mesh.vertices.row(mesh.faces(f, corner));
      const Eigen::RowVector3d b = mesh.vertices.row(mesh.faces(f, (corner + 1) % 3));
      if ((a[axis] < value) != (b[axis] < value)) {
        at(Eigen::RowVector3d(a + (value - a[axis]) / (b[axis] - a[axis]) * (b - a)));
      }
    }
  }
}

/// The narrowest neckline whose ends lie beside the neck on both sides: where it leaves the
/// shoulders depends on how steep these are, and no two people's, nor two sides, are alike.
void measure_neckline(TailorMeasures& tailor, const Mesh& body) {
  constexpr double kAboveBase = 0.06;  // m; what is higher is neck and head
  constexpr double kAboveEnd = 0.02;   // m over the shoulder, where a seam's threads pass the neck
  constexpr double kBeside = 0.012;    // m that cloth keeps off the neck
  constexpr double kWidest = 0.04;     // m more than usual
  const double usual = tailor.neck_girth / 6 + 0.015;
  for (tailor.neckline = usual; tailor.neckline < usual + kWidest; tailor.neckline += 0.005) {
    bool clear = true;
    tailor.ridge = 0;
    for (const double side : {-1.0, 1.0}) {
      double end = 0;
      for_section(body, 0, tailor.neck_base.x() + side * tailor.neckline,
                  [&](const Eigen::RowVector3d& point) {
                    if (point.y() < tailor.neck_base.y() + kAboveBase) {
                      end = std::max(end, point.y());
                    }
                  });
      double neck = 0;
      for_section(body, 1, end + kAboveEnd, [&](const Eigen::RowVector3d& point) {
        neck = std::max(neck, side * (point.x() - tailor.neck_base.x()));
      });
      clear = clear && neck + kBeside <= tailor.neckline;
      tailor.ridge = std::max(tailor.ridge, end);
    }
    if (clear) {
      return;
    }
  }
}

}  // namespace

TailorMeasures tailor_measures(const BodyModel& body) {
  // Bodies of other makers have their own names for joints.
  BodyModel model = body;
  model.skeleton = with_smpl_names(body.skeleton, recognised_humanoid(body.skeleton));
  const BodyMeasurements measured = measure_body(model);
  const Points joints = rest_positions(model.skeleton);
  const auto joint = [&](const char* name) -> Eigen::Vector3d {
    const int index = find_joint(model.skeleton, name);
    ATELIER_CHECK(index >= 0, std::string("the body has no joint ") + name);
    return joints.row(index).transpose();
  };
  TailorMeasures tailor;
  tailor.neck_girth = measured.neck_girth;
  tailor.chest_girth = measured.chest_girth;
  tailor.waist_girth = measured.waist_girth;
  tailor.hip_girth = measured.hip_girth;
  tailor.upper_arm_girth = measured.upper_arm_girth;
  tailor.thigh_girth = measured.thigh_girth;
  tailor.shoulder_width = measured.shoulder_breadth;
  tailor.arm_length = measured.arm_length;
  tailor.neck_base = joint("neck");
  tailor.hip = (joint("left_hip") + joint("right_hip")) / 2;
  const Eigen::Vector3d pelvis = joint("pelvis");
  tailor.waist = pelvis + 0.33 * (tailor.neck_base - pelvis);  // where measure_body takes the girth
  tailor.left_shoulder = joint("left_shoulder");
  tailor.right_shoulder = joint("right_shoulder");
  tailor.left_wrist = joint("left_wrist");
  tailor.right_wrist = joint("right_wrist");
  tailor.left_ankle = joint("left_ankle");
  tailor.right_ankle = joint("right_ankle");
  tailor.back_length = tailor.neck_base.y() - tailor.waist.y();
  tailor.waist_to_hip = tailor.waist.y() - tailor.hip.y();
  tailor.inseam = measured.leg_length - tailor.left_ankle.y();
  measure_neckline(tailor, body.mesh);
  return tailor;
}

}  // namespace atelier
