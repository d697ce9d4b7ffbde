#if defined(ATELIER_HAS_BODYMODEL) && defined(ATELIER_HAS_REGISTRATION)

#include "apps/tailor.h"

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/measure.h"
#include "core/error.h"

namespace atelier {

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
  return tailor;
}

}  // namespace atelier

#endif
