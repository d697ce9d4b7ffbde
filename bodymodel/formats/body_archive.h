#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "bodymodel/body_model.h"
#include "bodymodel/motion_clip.h"
#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

class Npz;

/// Body models and motions as npz of our own, which numpy opens as they are. Metres, Y up, which
/// the arrays "unit" ("m") and "up" ("y") say and reading insists on; the array "schema" says
/// "atelier-body-1" or "atelier-motion-1". Everything reads back to the same bits.
///
/// Body: joint_names, parents, offsets, rest_rotations, limits_min, limits_max, vertices, faces,
/// uvs, uv_faces, skin_joints, skin_weights, shape_names, shape_units, shape_ranges [S,3] (neutral,
/// min, max), shape_joints [S,J,3]; the surfaces of shapes and correctives one after the other:
/// *_starts [N+1], *_vertices (-1 in front of a dense one), *_offsets; corrective_features [C,3]
/// (joint, feature, component), corrective_axes; regressor_starts, _vertices, _weights;
/// group_names, group_starts, group_vertices.
std::map<std::string, Tensor> body_arrays(const BodyModel& model);
BodyModel body_of_arrays(const Npz& npz, const Limits& limits = {});

/// Motion: joint_names, parents, offsets, rest_rotations, end_site_joints, end_site_offsets, fps,
/// frame_ids, root_translation [F,3], rotations [F,J,3].
std::map<std::string, Tensor> motion_arrays(const MotionClip& clip);
MotionClip motion_of_arrays(const Npz& npz, const Limits& limits = {});

/// Files. Reading throws DataError, naming the array, for whatever the arrays above should be and
/// are not, and for a number beyond `limits.mesh_coordinate`; writing throws EnvironmentError.
void write_body(const std::filesystem::path& path, const BodyModel& model);
BodyModel read_body(const std::filesystem::path& path, const Limits& limits = {});
void write_motion(const std::filesystem::path& path, const MotionClip& clip);
MotionClip read_motion(const std::filesystem::path& path, const Limits& limits = {});

/// "atelier-body-1", "atelier-motion-1" or, for npz of others, "".
std::string archive_schema(const Npz& npz);

}  // namespace atelier
