#include "bodymodel/body_model.h"
#include "bodymodel/formats/motion_amass.h"
#include "bodymodel/formats/smpl.h"
#include "fuzz/npz_arrays.h"
#include "fuzz/reader.h"

namespace {

/// A body of SMPL that stands in a T-pose, with two shapes that move its joints.
atelier::BodyModel small_smpl() {
  atelier::BodyModel model;
  model.name = "smpl_female";
  model.skeleton.names = atelier::smpl_joint_names(24);
  model.skeleton.parents = atelier::smpl_parents(24);
  model.skeleton.offsets = atelier::Points::Zero(24, 3);
  model.skeleton.offsets.col(0).setConstant(0.2);
  for (const char* name : {"beta_0", "beta_1"}) {
    atelier::ShapeParameter parameter;
    parameter.name = name;
    parameter.joints = atelier::Points::Constant(24, 3, 0.01);
    model.shape.push_back(parameter);
  }
  return model;
}

}  // namespace

ATELIER_FUZZ_READER(amass) {
  const atelier::Npz npz = atelier::fuzz::npz_of(bytes, "amass");
  atelier::check_motion_clip(atelier::read_amass(npz), "amass");
  static const atelier::BodyModel body = small_smpl();
  atelier::check_motion_clip(atelier::read_amass(npz, &body), "amass");
}
