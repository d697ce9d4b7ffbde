#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/skinning.h"
#include "core/mesh.h"

namespace atelier::python {

// What an argument must agree with is said as data that cannot be used, with the argument's name;
// the libraries below take the same for a mistake of the program (LogicError). Numbers that a user
// has written into a struct's array are looked at here too.

/// Throws DataError unless `found`, the rows of the argument `where`, are as many as `expected`,
/// which `of` names: "joints of the model".
void require_rows(const std::string& where, Index found, Index expected, const std::string& of);

/// Throws DataError at the first face of a vertex that is not there.
void require_faces(const Triangles& faces, Index vertices);

/// Throws DataError at the first index of the argument `where` that is no vertex.
void require_vertices(const std::string& where, const std::vector<int>& indices, Index vertices);

/// Throws DataError for a pose of another skeleton, or one that is not finite.
void require_pose(const Pose& pose, Index joints);

/// Throws DataError for a body that `shape_body` made of another model.
void require_body(const BodyModel& model, const ShapedBody& body);

}  // namespace atelier::python
