#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "capture/label_taxonomy.h"
#include "core/archive.h"
#include "core/camera.h"
#include "core/garment.h"
#include "core/image.h"
#include "core/pose.h"
#include "core/render/scene.h"
#include "core/skeleton.h"

namespace atelier {

/// A garment of a synthetic capture: sewn, with the pattern it was cut from.
struct TruthGarment {
  Garment garment;          ///< sewn and draped; `rest` and `rest_faces` are the flat panels
  std::vector<Seam> seams;  ///< pairs of rows of `rest`; empty where there was no pattern
  Label label = Label::Unknown;
};

/// What of a synthetic capture does not change from frame to frame.
struct CaptureTruth {
  std::vector<Camera> cameras;  ///< the true ones, with gain
  Skeleton skeleton;            ///< at the subject's shape
  std::vector<std::string> shape_names;
  Eigen::VectorXd shape;  ///< [S] values of the subject's shape parameters (or measures)
  Mesh body;              ///< the subject's true surface in rest pose; uvs and labels where known
  Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> skin_joints;      ///< [V,K]
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> skin_weights;  ///< [V,K]
  std::vector<Mesh> layers;              ///< what else is seen (hair, shoes), rest pose
  std::vector<std::string> layer_names;  ///< their names
  std::vector<TruthGarment> garments;
  std::vector<std::string> keypoint_names;  ///< of keypoints in every frame
  std::vector<AreaLight> lights;
  Environment environment;                   ///< gradient alone
  std::map<std::string, double> numbers;     ///< displacement_rms, soft_tissue, exposure, ...
  std::map<std::string, std::string> texts;  ///< motion, garment, subject, preset, ...
};

/// One frame of it. What was not there (cloth in a minimal sequence) is empty.
struct TruthFrame {
  int frame_id = 0;
  Points joints;                 ///< [J,3] metres
  Pose pose;                     ///< of the skeleton; empty for bodies from files
  Points keypoints;              ///< [K,3] metres
  Points body;                   ///< [V,3] metres
  std::vector<Points> layers;    ///< as CaptureTruth::layers; empty rows: not worn
  std::vector<Points> garments;  ///< as CaptureTruth::garments; empty rows: not worn
  ByteImage body_seen;           ///< width V, height C: 1 where a camera sees the vertex, or empty
  std::vector<ByteImage> garments_seen;  ///< the same of each garment
};

/// truth/truth.h5 (schema "atelier.truth", version 1) and truth/frames/000012.h5 (schema
/// "atelier.truth.frame", version 1) of docs/reference/formats.md, and back. Reading throws
/// DataError for arrays that are missing, of another shape, or out of range.
Archive archive_of(const CaptureTruth& truth);
CaptureTruth truth_of(const Archive& archive, const std::string& file = "");
Archive archive_of(const TruthFrame& frame, const CaptureTruth& truth);
TruthFrame truth_frame_of(const Archive& archive, const CaptureTruth& truth,
                          const std::string& file = "");

CaptureTruth read_capture_truth(const std::filesystem::path& capture, const Limits& limits = {});
TruthFrame read_truth_frame(const std::filesystem::path& capture, const CaptureTruth& truth,
                            int frame_id, const Limits& limits = {});

/// "000012": how frames are named in a capture's files.
std::string frame_name(int frame_id);

}  // namespace atelier
