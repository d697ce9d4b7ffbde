// Makes a body of given stature, lifts its arms and writes the posed mesh.
//   skin_body OUT.ply [STATURE]
#include <cstdlib>
#include <exception>
#include <iostream>

#include "bodymodel/human/default_human.h"
#include "bodymodel/skinning.h"
#include "core/io/mesh_file.h"

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: skin_body OUT.ply [STATURE]\n";
    return 2;
  }
  try {
    atelier::DefaultHumanOptions options = atelier::female_human();
    options.stature = count > 2 ? std::atof(arguments[2]) : 1.68;  // metres
    const atelier::BodyModel model = default_human(options);

    // A pose is a rotation vector for each joint, relative to its parent. The wearer looks along
    // +Z, so that turning about Z moves an arm up and down.
    atelier::Pose pose;
    pose.rotations = atelier::Points::Zero(joint_count(model), 3);
    pose.rotations.row(find_joint(model.skeleton, "left_shoulder")) << 0, 0, 0.9;
    pose.rotations.row(find_joint(model.skeleton, "right_shoulder")) << 0, 0, -0.9;

    // The shape is evaluated once; any number of poses follow.
    const atelier::ShapedBody body = shape_body(model);
    atelier::Mesh mesh = model.mesh;
    mesh.vertices = skin_vertices(model, body, pose);
    mesh.normals.resize(0, 3);  // those of the rest pose
    write_mesh(arguments[1], mesh);
    const Eigen::RowVector3d extent =
        mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff();
    std::cout << mesh.vertices.rows() << " vertices, arm span " << extent.x() << " m, height "
              << extent.y() << " m\n";
  } catch (const std::exception& error) {
    std::cerr << "skin_body: " << error.what() << "\n";
    return 3;
  }
}
