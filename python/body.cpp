#include <optional>

#include "bodymodel/body_model.h"
#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/measure.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "bodymodel/skinning_jacobian.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/checks.h"
#include "python/options.h"
#include "python/signals.h"

namespace atelier {

/// Beside the struct, which the command line does not show.
static OptionTable describe(SkinOptions& options) {
  OptionTable table;
  table.add("method", options.method,
            {{"linear", SkinMethod::Linear}, {"dual_quaternion", SkinMethod::DualQuaternion}},
            "Linear blend skinning, or dual quaternions, which keep volume under twists");
  table.add("correctives", options.correctives, "Pose correctives of the model");
  table.add("device", options.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Device on which vertices are skinned");
  table.add("vectors", options.vectors, "AVX2 where the processor has it");
  return table;
}

}  // namespace atelier

ATELIER_OPTIONS(SkinOptions);
ATELIER_OPTIONS(DefaultHumanOptions);
ATELIER_OPTIONS(MotionOptions);
ATELIER_OPTIONS(RetargetOptions);

namespace atelier::python {
namespace {

using namespace py::literals;
using Path = std::filesystem::path;

/// Throws DataError for a shape of another model.
void require_shape(const BodyModel& model, const Eigen::VectorXd& shape) {
  if (shape.size() > 0) {
    require_rows("shape", shape.size(), static_cast<Index>(model.shape.size()),
                 "shape parameters of the model");
  }
}

void bind_models(py::module_& module) {
  py::class_<BodyModel> model(
      module, "BodyModel", "A parametric body: shape space, joints, skinning, pose correctives.");
  model.def_readonly("name", &BodyModel::name);
  model.def_property_readonly(
      "skeleton", [](const BodyModel& self) { return self.skeleton; },
      "rest pose at the neutral shape, copied");
  model.def_property_readonly(
      "mesh", [](const BodyModel& self) { return self.mesh; },
      "template at the neutral shape, rest pose, copied");
  model.def_property_readonly(
      "skin_joints",
      [](py::object self) { return array_over(self.cast<BodyModel&>().skin.joints, self); },
      "[V,K] joints that move each vertex");
  model.def_property_readonly(
      "skin_weights",
      [](py::object self) { return array_over(self.cast<BodyModel&>().skin.weights, self); },
      "[V,K] and how much; rows sum to 1");
  model.def_property_readonly(
      "shape_names",
      [](const BodyModel& self) {
        std::vector<std::string> names;
        for (const ShapeParameter& one : self.shape) {
          names.push_back(one.name);
        }
        return names;
      },
      "[S] names of the shape's parameters");
  model.def_property_readonly(
      "shape_units",
      [](const BodyModel& self) {
        std::vector<std::string> units;
        for (const ShapeParameter& one : self.shape) {
          units.push_back(one.unit);
        }
        return units;
      },
      "[S] \"m\", \"kg\", \"sd\" (standard deviations), \"\"");
  model.def_property_readonly("corrective_count",
                              [](const BodyModel& self) { return self.correctives.size(); });
  model.def_property_readonly(
      "groups",
      [](const BodyModel& self) {
        py::dict groups;
        for (const VertexGroup& group : self.groups) {
          groups[py::str(group.name)] = array_of(std::vector<int>(group.vertices));
        }
        return groups;
      },
      "vertices by name: regions, landmarks, rings");
  model.def("__repr__", [](const BodyModel& self) {
    return "<BodyModel '" + self.name + "', " + std::to_string(vertex_count(self)) + " vertices, " +
           std::to_string(joint_count(self)) + " joints, " + std::to_string(self.shape.size()) +
           " shape parameters>";
  });
  module.def("joint_count", &joint_count, "model"_a, "Number of joints, J.");
  module.def("vertex_count", &vertex_count, "model"_a, "Number of vertices, V.");
  module.def("neutral_shape", &neutral_shape, "model"_a,
             "[S] the shape of the template, in the units of `shape_units`.");
  module.def("find_shape", &find_shape, "model"_a, "name"_a,
             "Index of a shape parameter, -1 if there is none.");
  module.def(
      "at_shape",
      [](const BodyModel& body, const Eigen::VectorXd& shape) {
        require_shape(body, shape);
        return at_shape(body, shape);
      },
      "model"_a, "shape"_a, py::call_guard<LongCall>(),
      "The model with `shape` as its neutral shape.");
  module.def(
      "read_body_file",
      [](const Path& path, double metres_per_unit) {
        BodyFileOptions options;
        options.metres_per_unit = metres_per_unit;
        return read_body_file(path, options).model;
      },
      "path"_a, "metres_per_unit"_a = 1.0, py::call_guard<LongCall>(),
      "A body of any format (SMPL's family, MakeHuman, glTF, FBX, ours), or \"default\", "
      "\"female\", "
      "\"male\".");
  module.def("write_body", &write_body, "path"_a, "model"_a, py::call_guard<LongCall>(),
             "The body as .npz.");
  module.def("default_human", &default_human, "options"_a = py::none(), py::call_guard<LongCall>(),
             "A procedural adult in A-pose: 12k vertices, 55 joints with SMPL-X's names.");
  module.def("female_human", &female_human, "Options of an average woman.");
  module.def("male_human", &male_human, "Options of an average man.");
  module.def(
      "percentile_human", &percentile_human, "male"_a, "percentiles"_a,
      "Options of a body at percentiles (0.05 is the 5th) of its twelve measures, stature and "
      "mass first, in the order of DefaultHumanOptions; `male` is 0 for a woman, 1 for a man.");
  module.def(
      "measure_body",
      [](const BodyModel& body, const Eigen::VectorXd& shape) {
        require_shape(body, shape);
        const BodyMeasurements measured = measure_body(body, shape);
        std::map<std::string, double> values;
        for (const NamedMeasurement& one : measurement_names()) {
          values[one.name] = measured.*one.value;
        }
        return values;
      },
      "model"_a, "shape"_a = py::none(), py::call_guard<LongCall>(),
      "A tailor's measurements by name, metres and kilograms.");
}

void bind_skinning(py::module_& module) {
  py::class_<ShapedBody> shaped(
      module, "ShapedBody", "A body at one shape, in its rest pose: made once, posed many times.");
  shaped.def_property_readonly(
      "skeleton", [](const ShapedBody& self) { return self.skeleton; }, "copied");
  shaped.def_property_readonly(
      "vertices",
      [](py::object self) { return array_over(self.cast<ShapedBody&>().vertices, self); },
      "[V,3] rest vertices without correctives, metres");
  shaped.def_property_readonly(
      "joints", [](py::object self) { return array_over(self.cast<ShapedBody&>().joints, self); },
      "[J,3] rest joints, metres");
  module.def(
      "shape_body",
      [](const BodyModel& model, const Eigen::VectorXd& shape) {
        require_shape(model, shape);
        return shape_body(model, shape);
      },
      "model"_a, "shape"_a = py::none(), py::call_guard<LongCall>(),
      "Evaluates the shape space; `shape` [S], or None: neutral.");
  module.def(
      "skin_vertices",
      [](const BodyModel& model, const ShapedBody& body, const Pose& pose,
         const SkinOptions& options) {
        require_body(model, body);
        require_pose(pose, joint_count(model));
        return skin_vertices(model, body, pose, options);
      },
      "model"_a, "body"_a, "pose"_a, "options"_a = py::none(), py::call_guard<LongCall>(),
      "Posed vertices [V,3], metres.");
  module.def(
      "skin_motion",
      [](const BodyModel& model, const ShapedBody& body, const Motion& motion,
         const SkinOptions& options) {
        require_body(model, body);
        for (const Pose& pose : motion.poses) {
          require_pose(pose, joint_count(model));
        }
        const auto frames = static_cast<Index>(motion.poses.size());
        const Index vertices = vertex_count(model);
        std::vector<double> numbers(static_cast<std::size_t>(frames * vertices * 3));
        {
          const LongCall released;
          SignalWatch watch;
          for (Index i = 0; i < frames; ++i) {
            watch.check();
            const Points posed =
                skin_vertices(model, body, motion.poses[static_cast<std::size_t>(i)], options);
            std::copy(posed.data(), posed.data() + posed.size(), numbers.data() + i * vertices * 3);
          }
        }
        return array_of(std::move(numbers)).reshape({frames, vertices, Index{3}});
      },
      "model"_a, "body"_a, "motion"_a, "options"_a = py::none(),
      "Posed vertices of every frame, [N,V,3] metres.");
  py::class_<JointFrames> frames(module, "JointFrames", "Where every joint is.");
  frames.def_property_readonly(
      "positions",
      [](py::object self) { return array_over(self.cast<JointFrames&>().positions, self); },
      "[J,3] metres");
  frames.def_property_readonly(
      "rotations",
      [](const JointFrames& self) {
        std::vector<double> numbers;
        for (const Eigen::Matrix3d& one : self.rotations) {
          for (int i = 0; i < 9; ++i) {
            numbers.push_back(one(i / 3, i % 3));
          }
        }
        return array_of(std::move(numbers))
            .reshape(
                {static_cast<py::ssize_t>(self.rotations.size()), py::ssize_t{3}, py::ssize_t{3}});
      },
      "[J,3,3] world_from_joint, copied");
  module.def(
      "forward_kinematics",
      [](const Skeleton& skeleton, const Pose& pose) {
        check_skeleton(skeleton, "skeleton");
        require_pose(pose, static_cast<Index>(skeleton.names.size()));
        return forward_kinematics(skeleton, pose);
      },
      "skeleton"_a, "pose"_a, "Frames of all joints at a pose.");
  module.def("rest_pose", &rest_pose, "skeleton"_a, "All rotations zero.");
  module.def("pose_vector", &pose_vector, "pose"_a,
             "[3 + 3J]: translation, then rotation vectors joint by joint.");
  module.def("pose_of_vector", &pose_of_vector, "values"_a,
             "The pose of a `pose_vector` [3 + 3J]: translation in metres, rotation vectors in "
             "radians.");
}

void bind_derivatives(py::module_& module) {
  py::class_<PosedBody> posed(
      module, "PosedBody", "Joint transforms of a pose, shared by skinning and its derivatives.");
  posed.def_property_readonly(
      "vertices",
      [](py::object self) { return array_over(self.cast<PosedBody&>().vertices, self); },
      "[V,3] metres");
  posed.def_property_readonly(
      "frames", [](PosedBody& self) -> JointFrames& { return self.frames; },
      py::return_value_policy::reference_internal);
  py::class_<SkinChains>(module, "SkinChains",
                         "For every vertex the joints whose rotation moves it.");
  py::class_<SkinRows> rows(
      module, "SkinRows",
      "Sparse rows: row i is the derivative of directions[i] . x(vertices[i]).");
  array_field<&SkinRows::begin>(rows, "begin", "[R+1] into joints and values");
  array_field<&SkinRows::joints>(rows, "joints", "[N] which joint's rotation");
  array_field<&SkinRows::values>(rows, "values", "[N,3] derivative by that rotation vector");
  module.def(
      "pose_body",
      [](const BodyModel& model, const ShapedBody& body, const Pose& pose, bool correctives) {
        require_body(model, body);
        require_pose(pose, joint_count(model));
        return pose_body(model, body, pose, correctives);
      },
      "model"_a, "body"_a, "pose"_a, "correctives"_a = true, py::call_guard<LongCall>(),
      "Vertices and what derivatives need.");
  module.def("skin_chains", &skin_chains, "model"_a, "correctives"_a = true,
             py::call_guard<LongCall>(),
             "Which joints move which vertices: what `skin_jacobian_rows` needs of a model, once.");
  module.def("skin_jacobian_rows", &skin_jacobian_rows, "model"_a, "posed"_a, "chains"_a,
             "vertices"_a, "directions"_a, py::call_guard<LongCall>(),
             "Derivatives by pose of projections of vertices [R] on directions [R,3].");
  module.def("skin_shape_rows", &skin_shape_rows, "model"_a, "body"_a, "posed"_a, "vertices"_a,
             "directions"_a, py::call_guard<LongCall>(), "The same by shape, dense [R,S].");
}

void bind_motions(py::module_& module) {
  py::class_<MotionClip> clip(module, "MotionClip", "A recorded motion and the skeleton it moves.");
  clip.def_readonly("name", &MotionClip::name);
  clip.def_property_readonly(
      "skeleton", [](const MotionClip& self) { return self.skeleton; }, "copied");
  clip.def_property_readonly(
      "motion", [](MotionClip& self) -> Motion& { return self.motion; },
      py::return_value_policy::reference_internal);
  clip.def_readonly("findings", &MotionClip::findings, "guesses and repairs of the reader");
  module.def(
      "read_motion_file",
      [](const Path& path, const MotionOptions& options) {
        MotionFileOptions all;
        all.motion = options;
        return read_motion_file(path, all);
      },
      "path"_a, "options"_a = py::none(), py::call_guard<LongCall>(),
      "BVH, AMASS, glTF, FBX, AMC, C3D or TRC, in metres, Y up.");
  module.def("write_motion_file", &write_motion_file, "path"_a, "clip"_a,
             py::call_guard<LongCall>(), "By extension: .bvh, .trc, .npz, .glb, .gltf.");
  py::class_<Retargeted> moved(module, "Retargeted", "A motion on another body.");
  moved.def_property_readonly(
      "motion", [](Retargeted& self) -> Motion& { return self.motion; },
      py::return_value_policy::reference_internal);
  moved.def_readonly("scale", &Retargeted::scale, "target's legs over the clip's");
  moved.def_readonly("findings", &Retargeted::findings);
  module.def("retarget", &retarget, "clip"_a, "model"_a, "shape"_a = py::none(),
             "options"_a = py::none(), py::call_guard<LongCall>(),
             "Moves a body by a motion of another skeleton.");

  py::class_<TrackedMotion> tracked(module, "TrackedMotion",
                                    "A person's poses found in a capture.");
  tracked.def_property_readonly(
      "skeleton", [](const TrackedMotion& self) { return self.skeleton; }, "copied");
  tracked.def_property_readonly(
      "motion", [](TrackedMotion& self) -> Motion& { return self.motion; },
      py::return_value_policy::reference_internal);
  array_field<&TrackedMotion::deviations>(tracked, "deviations",
                                          "[F,J] metres, standard deviation of each joint's place");
  array_field<&TrackedMotion::trusted>(tracked, "trusted", "[F] 0: bridged, or off what was seen");
  array_field<&TrackedMotion::keypoint_rms>(tracked, "keypoint_rms", "[F] metres");
  array_field<&TrackedMotion::scan_rms>(tracked, "scan_rms", "[F] metres");
  module.def(
      "read_tracked_motion", [](const Path& path) { return read_tracked_motion(path); }, "path"_a,
      py::call_guard<LongCall>(), "A file of tracked/ in a result of the stage `track`.");
}

}  // namespace

void bind_body(py::module_& module) {
  ATELIER_OPTIONS_CLASS(SkinOptions);
  ATELIER_OPTIONS_CLASS(DefaultHumanOptions);
  ATELIER_OPTIONS_CLASS(MotionOptions);
  ATELIER_OPTIONS_CLASS(RetargetOptions);
  bind_models(module);
  bind_skinning(module);
  bind_derivatives(module);
  bind_motions(module);
}

}  // namespace atelier::python
