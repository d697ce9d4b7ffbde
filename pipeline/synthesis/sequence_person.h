#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/io/mesh_sequence_file.h"
#include "core/skeleton.h"

namespace atelier {

/// Place of a keypoint on a body of a sequence: the mean of two joints (twice the same for one), or
/// a point of a triangle.
struct SequenceKeypoint {
  std::string name;
  std::array<int, 2> joints = {-1, -1};  ///< of SequencePerson::rows; -1: on the surface
  int face = -1;
  Eigen::Vector3d barycentric{0, 0, 0};  ///< sums to 1
};

/// The person in a sequence of bodies that another program made. No joints, no keypoints: the file
/// has none, or none that match a person and no name of a keypoint.
struct SequencePerson {
  /// The file's joints, parents first, as they are in the first frame, turned about the vertical so
  /// that the person faces +Z.
  Skeleton skeleton;
  std::vector<int> rows;  ///< row of each joint in the file's; behind the skeleton's, of others
                          ///< that are keypoints by their name
  std::vector<SequenceKeypoint> keypoints;
  std::string problem;  ///< why there is no person; ""
};

/// Finds the person's joints by names or topology (bodymodel/humanoid.h; a file without parents has
/// names alone) and places the points of COCO-WholeBody and BODY_25 as subject_keypoints does, on
/// the first frame's surface, whose vertices it takes for the nearest bone's. Fingers that the
/// skeleton does not have are left out. Joints with the name of a keypoint are keypoints in any
/// case. Our choice.
SequencePerson sequence_person(const MeshSequenceFile& body);

/// [J,3] the person's joints out of a frame's of the file, [R,3].
Points person_joints(const SequencePerson& person, const Points& file_joints);

/// [K,3] keypoints of a frame. @param vertices, faces  of the body
Points person_keypoints(const SequencePerson& person, const Points& file_joints,
                        const Points& vertices, const Triangles& faces);

/// Lines for the user: how many of a schema's keypoints have a place, and which have none.
std::vector<std::string> sequence_person_lines(const SequencePerson& person,
                                               const std::string& schema);

}  // namespace atelier
