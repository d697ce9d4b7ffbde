#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "core/io/text_writer.h"

namespace atelier::fixtures {

struct FbxTextOptions {
  double centimetres = 1;  ///< of the file's unit; what is said and what is meant
  bool z_up = false;       ///< x right, z up, y away: as 3ds Max has it
  bool unweighted = true;  ///< clusters also for joints that move nothing
  Eigen::Matrix4d moved =
      Eigen::Matrix4d::Identity();  ///< the root's node, away from its bind pose
  bool mesh_below_root = false;     ///< the mesh's node is carried by the root's
};

template <class Numbers>
std::string fbx_array(const char* name, const Numbers& numbers) {
  std::string text = std::string(name) + ": *" + std::to_string(std::size(numbers)) + " {\n a: ";
  bool first = true;
  for (const auto number : numbers) {
    text += (first ? "" : ",") + number_text(number);
    first = false;
  }
  return text + "\n}\n";
}

inline std::string fbx_property(const char* name, double x, double y, double z) {
  return std::string("P: \"") + name + "\", \"" + name + "\", \"\", \"A\"," + number_text(x) + "," +
         number_text(y) + "," + number_text(z) + "\n";
}

/// Global settings as the options say.
inline std::string fbx_head(const FbxTextOptions& options) {
  const auto setting = [](const char* name, int value) {
    return std::string("P: \"") + name + "\", \"int\", \"Integer\", \"\"," + std::to_string(value) +
           "\n";
  };
  return "; FBX 7.4.0 project file\nFBXHeaderExtension: {\nFBXHeaderVersion: 1003\nFBXVersion: "
         "7400\n}\nGlobalSettings: {\nVersion: 1000\nProperties70: {\n" +
         setting("UpAxis", options.z_up ? 2 : 1) + setting("UpAxisSign", 1) +
         setting("FrontAxis", options.z_up ? 1 : 2) +
         setting("FrontAxisSign", options.z_up ? -1 : 1) + setting("CoordAxis", 0) +
         setting("CoordAxisSign", 1) + "P: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," +
         number_text(options.centimetres) + "\n}\n}\n";
}

/// A body as FBX text, written after the format and not after any library: mesh with texture
/// coordinates by index, limb nodes, a cluster for each joint, shape parameters as blend shapes.
inline std::string fbx_text(const BodyModel& model, const FbxTextOptions& options = {}) {
  const double unit = options.centimetres / 100;
  Eigen::Matrix4d file_from_world = Eigen::Matrix4d::Identity();
  if (options.z_up) {
    file_from_world << 1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1;
  }
  const Eigen::Matrix3d turn = file_from_world.topLeftCorner<3, 3>();
  const auto rows = [&](const Points& points) {
    std::vector<double> numbers;
    for (Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d p = turn * points.row(i).transpose() / unit;
      numbers.insert(numbers.end(), p.begin(), p.end());
    }
    return numbers;
  };
  const JointFrames rest = forward_kinematics(model.skeleton, rest_pose(model.skeleton));
  const std::size_t joints = model.skeleton.names.size();
  std::vector<Eigen::Matrix4d> frames(joints, Eigen::Matrix4d::Identity());
  for (std::size_t j = 0; j < joints; ++j) {
    frames[j].topLeftCorner<3, 3>() = turn * rest.rotations[j];
    frames[j].topRightCorner<3, 1>() =
        turn * rest.positions.row(static_cast<Index>(j)).transpose() / unit;
  }
  std::string objects = "Geometry: 100, \"Geometry::body\", \"Mesh\" {\n";
  objects += fbx_array("Vertices", rows(model.mesh.vertices));
  std::vector<int> corners(model.mesh.faces.data(),
                           model.mesh.faces.data() + model.mesh.faces.size());
  for (std::size_t i = 2; i < corners.size(); i += 3) {
    corners[i] = -corners[i] - 1;  // how FBX ends a polygon
  }
  objects += fbx_array("PolygonVertexIndex", corners);
  if (model.mesh.uvs.rows() > 0) {
    objects +=
        "LayerElementUV: 0 {\nVersion: 101\nName: \"map\"\nMappingInformationType: "
        "\"ByPolygonVertex\"\nReferenceInformationType: \"IndexToDirect\"\n";
    objects += fbx_array("UV", std::vector<double>(model.mesh.uvs.data(),
                                                   model.mesh.uvs.data() + model.mesh.uvs.size()));
    objects +=
        fbx_array("UVIndex",
                  std::vector<int>(model.mesh.uv_faces.data(),
                                   model.mesh.uv_faces.data() + model.mesh.uv_faces.size())) +
        "}\nLayer: 0 {\nVersion: 100\nLayerElement: {\nType: \"LayerElementUV\"\nTypedIndex: "
        "0\n}\n}\n";
  }
  // Where the mesh's node stands when it is bound: at the root's, or at the origin.
  const Eigen::Matrix4d below = Eigen::Matrix4d(frames[0].inverse());
  objects +=
      "}\nModel: 200, \"Model::body\", \"Mesh\" {\nVersion: 232\n" +
      (options.mesh_below_root
           ? "Properties70: {\n" +
                 fbx_property("Lcl Translation", below(0, 3), below(1, 3), below(2, 3)) + "}\n"
           : std::string()) +
      "}\n";
  objects += "Deformer: 300, \"Deformer::\", \"Skin\" {\nVersion: 101\n}\n";
  std::string connections = std::string("C: \"OO\",200,") +
                            (options.mesh_below_root ? "1000" : "0") +
                            "\nC: \"OO\",100,200\nC: \"OO\",300,100\n";
  const auto connect = [&](std::size_t from, std::size_t to) {
    connections += "C: \"OO\"," + std::to_string(from) + "," + std::to_string(to) + "\n";
  };
  for (std::size_t j = 0; j < joints; ++j) {
    const int parent = model.skeleton.parents[j];
    Eigen::Matrix4d local =
        parent < 0
            ? Eigen::Matrix4d(options.moved * frames[j])
            : Eigen::Matrix4d(frames[static_cast<std::size_t>(parent)].inverse() * frames[j]);
    const double degrees = 180 / 3.14159265358979323846;
    objects += "Model: " + std::to_string(1000 + j) + ", \"Model::" + model.skeleton.names[j] +
               "\", \"LimbNode\" {\nVersion: 232\nProperties70: {\n" +
               fbx_property("Lcl Translation", local(0, 3), local(1, 3), local(2, 3)) +
               fbx_property("Lcl Rotation", degrees * std::atan2(local(2, 1), local(2, 2)),
                            degrees * std::asin(std::clamp(-local(2, 0), -1.0, 1.0)),
                            degrees * std::atan2(local(1, 0), local(0, 0))) +
               "}\n}\n";
    connect(1000 + j, parent < 0 ? 0 : 1000 + static_cast<std::size_t>(parent));
    std::vector<int> moved;
    std::vector<double> weights;
    for (Index v = 0; v < vertex_count(model); ++v) {
      for (Index k = 0; k < model.skin.joints.cols(); ++k) {
        if (model.skin.joints(v, k) == static_cast<int>(j) && model.skin.weights(v, k) != 0) {
          moved.push_back(static_cast<int>(v));
          weights.push_back(model.skin.weights(v, k));
        }
      }
    }
    if (moved.empty() && !options.unweighted) {
      continue;
    }
    objects += "Deformer: " + std::to_string(3000 + j) +
               ", \"SubDeformer::\", \"Cluster\" {\nVersion: 100\n";
    if (!moved.empty()) {
      objects += fbx_array("Indexes", moved) + fbx_array("Weights", weights);
    }
    objects += fbx_array("Transform", Eigen::Matrix4d(frames[j].inverse()).reshaped().eval()) +
               fbx_array("TransformLink", frames[j].reshaped().eval()) + "}\n";
    connect(3000 + j, 300);
    connect(1000 + j, 3000 + j);
  }
  if (!model.shape.empty()) {
    objects += "Deformer: 400, \"Deformer::\", \"BlendShape\" {\nVersion: 100\n}\n";
    connect(400, 100);
  }
  for (std::size_t s = 0; s < model.shape.size(); ++s) {
    std::vector<int> all(static_cast<std::size_t>(vertex_count(model)));
    for (std::size_t v = 0; v < all.size(); ++v) {
      all[v] = static_cast<int>(v);
    }
    const std::vector<double> offsets = rows(model.shape[s].surface.offsets);
    objects += "Deformer: " + std::to_string(5000 + s) + ", \"SubDeformer::" + model.shape[s].name +
               "\", \"BlendShapeChannel\" {\nVersion: 100\nDeformPercent: 0\n" +
               fbx_array("FullWeights", std::vector<double>{100}) +
               "}\nGeometry: " + std::to_string(6000 + s) + ", \"Geometry::" + model.shape[s].name +
               "\", \"Shape\" {\nVersion: 100\n" + fbx_array("Indexes", all) +
               fbx_array("Vertices", offsets) +
               fbx_array("Normals", std::vector<double>(offsets.size(), 0)) + "}\n";
    connect(5000 + s, 400);
    connect(6000 + s, 5000 + s);
  }
  return fbx_head(options) + "Objects: {\n" + objects + "}\nConnections: {\n" + connections + "}\n";
}

}  // namespace atelier::fixtures
