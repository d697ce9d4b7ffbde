#include "python/checks.h"

#include "core/error.h"
#include "python/arrays.h"

namespace atelier::python {

void require_rows(const std::string& where, Index found, Index expected, const std::string& of) {
  if (found != expected) {
    throw DataError("", where, std::to_string(found) + " rows",
                    std::to_string(expected) + ", the " + of);
  }
}

void require_faces(const Triangles& faces, Index vertices) {
  if (faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices)) {
    return;
  }
  for (Index f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      if (faces(f, k) < 0 || faces(f, k) >= vertices) {
        throw DataError("", "faces, row " + std::to_string(f), std::to_string(faces(f, k)),
                        "a vertex, 0 to " + std::to_string(vertices - 1));
      }
    }
  }
}

void require_vertices(const std::string& where, const std::vector<int>& indices, Index vertices) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < 0 || indices[i] >= vertices) {
      throw DataError("", where + ", row " + std::to_string(i), std::to_string(indices[i]),
                      "a vertex, 0 to " + std::to_string(vertices - 1));
    }
  }
}

void require_pose(const Pose& pose, Index joints) {
  require_rows("pose", pose.rotations.rows(), joints, "joints of the skeleton");
  require_finite(pose.rotations.data(), pose.rotations.size(), 3);
  require_finite(pose.root_translation.data(), 3, 1);
}

void require_body(const BodyModel& model, const ShapedBody& body) {
  require_rows("body", body.vertices.rows(), vertex_count(model), "vertices of the model");
  require_rows("body", body.joints.rows(), joint_count(model), "joints of the model");
}

}  // namespace atelier::python
