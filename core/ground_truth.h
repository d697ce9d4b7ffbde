#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/garment.h"
#include "core/image.h"
#include "core/label.h"
#include "core/light.h"
#include "core/mesh.h"
#include "core/pose.h"
#include "core/skeleton.h"

namespace atelier {

/// A garment of a synthetic capture: sewn, with the pattern it was cut from.
struct GroundTruthGarment {
  Garment garment;          ///< sewn and draped; `rest` and `rest_faces` are the flat panels
  std::vector<Seam> seams;  ///< pairs of rows of `rest`; empty where there was no pattern
  Label label = Label::Unknown;
};

/// The part of a synthetic capture's ground truth that is the same in all frames.
struct GroundTruth {
  std::vector<Camera> cameras;  ///< the true ones, with gain
  Skeleton skeleton;            ///< at the subject's shape
  std::vector<std::string> shape_names;
  Eigen::VectorXd shape;  ///< [S] values of the subject's shape parameters (or measures)
  Mesh body;              ///< the subject's true surface in rest pose; uvs and labels where known
  Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> skin_joints;      ///< [V,K]
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> skin_weights;  ///< [V,K]
  std::vector<Mesh> layers;              ///< what else is seen (hair, shoes), rest pose
  std::vector<std::string> layer_names;  ///< their names
  std::vector<GroundTruthGarment> garments;
  std::vector<std::string> keypoint_names;  ///< of keypoints in every frame
  std::vector<AreaLight> lights;
  Environment environment;                   ///< gradient alone
  std::map<std::string, double> numbers;     ///< displacement_rms, soft_tissue, exposure, ...
  std::map<std::string, std::string> texts;  ///< motion, garment, subject, preset, ...
};

/// One frame of it. Missing things (cloth in a minimal sequence) are empty.
struct GroundTruthFrame {
  int frame_id = 0;
  Points joints;                 ///< [J,3] metres
  Pose pose;                     ///< of the skeleton; empty for bodies from files
  Points keypoints;              ///< [K,3] metres
  Points body;                   ///< [V,3] metres
  std::vector<Points> layers;    ///< as GroundTruth::layers; empty rows: not worn
  std::vector<Points> garments;  ///< as GroundTruth::garments; empty rows: not worn
  ByteImage body_seen;           ///< width V, height C: 1 where a camera sees the vertex, or empty
  std::vector<ByteImage> garments_seen;  ///< the same of each garment
};

}  // namespace atelier
