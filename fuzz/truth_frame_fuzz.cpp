#include "core/io/ground_truth_archive.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

namespace {

/// The capture that the frames belong to: two cameras, two joints, a body of three vertices, a hat
/// of three and a scarf of four.
atelier::GroundTruth capture_truth() {
  atelier::GroundTruth truth;
  truth.cameras.resize(2);
  truth.skeleton.names = {"pelvis", "head"};
  truth.keypoint_names = {"nose"};
  truth.body.vertices = atelier::Points::Zero(3, 3);
  truth.layers.resize(1);
  truth.layers[0].vertices = atelier::Points::Zero(3, 3);
  truth.layer_names = {"hat"};
  truth.garments.resize(1);
  truth.garments[0].garment.name = "scarf";
  truth.garments[0].garment.mesh.vertices = atelier::Points::Zero(4, 3);
  return truth;
}

}  // namespace

/// What is read fits its capture and can be written.
ATELIER_FUZZ_READER(truth_frame) {
  static const atelier::GroundTruth truth = capture_truth();
  const atelier::Archive archive = atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                          "atelier.truth.frame", 1, "frame");
  const atelier::GroundTruthFrame frame = atelier::ground_truth_frame_of(archive, truth, "frame");
  ATELIER_CHECK(frame.body.rows() == 3 && frame.body.allFinite(), "a body of other vertices");
  ATELIER_CHECK(frame.keypoints.rows() == 1, "points of another schema");
  const atelier::GroundTruthFrame again =
      atelier::ground_truth_frame_of(atelier::archive_of(frame, truth), truth, "written");
  ATELIER_CHECK(again.frame_id == frame.frame_id && again.body == frame.body &&
                    again.body_seen.data == frame.body_seen.data,
                "a frame reads back as it was");
}
