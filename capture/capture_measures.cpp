#include "capture/capture_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/capture_info.h"
#include "capture/dome.h"
#include "capture/keypoint_schema.h"
#include "core/depths_inside.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/median.h"
#include "core/printable.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

Measure calibration(const std::vector<Camera>& truth, const std::vector<Camera>& written) {
  if (truth.size() != written.size()) {
    throw DataError("cameras.json", "", std::to_string(written.size()) + " cameras",
                    std::to_string(truth.size()) + ", as the ground truth has");
  }
  double sum = 0;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    sum += std::pow(reprojection_rms(truth[c], written[c]), 2);
  }
  return {"capture.calibration_px", std::sqrt(sum / static_cast<double>(truth.size())), "px", 0,
          Measure::Side::None,      "points of the capture volume, all cameras"};
}

struct DetectorErrors {
  std::vector<double> errors;  ///< px at 1000 rows
  int in_picture = 0;
};

/// Adds one picture's keypoints.
void add_detections(DetectorErrors& all, const fs::path& file, const KeypointSchema& schema,
                    const GroundTruth& truth, const GroundTruthFrame& frame, const Camera& camera) {
  const nlohmann::json parsed = read_json(file);
  const std::vector<JsonPlace> people = JsonPlace(parsed, file.string()).items("people");
  if (people.empty()) {
    return;
  }
  const std::vector<double> values = people.front().at("pose_keypoints_2d").numbers();
  if (values.size() != 3 * schema.points.size()) {
    people.front().fail(counted(static_cast<std::int64_t>(values.size()), "number"),
                        std::to_string(3 * schema.points.size()) + " of " + schema.name);
  }
  for (std::size_t i = 0; i < schema.points.size(); ++i) {
    const auto name =
        std::find(truth.keypoint_names.begin(), truth.keypoint_names.end(), schema.points[i]);
    if (name == truth.keypoint_names.end()) {
      continue;
    }
    const auto pixel =
        project(camera, frame.keypoints.row(name - truth.keypoint_names.begin()).transpose());
    if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width ||
        pixel->y() >= camera.height) {
      continue;
    }
    ++all.in_picture;
    if (values[3 * i + 2] > 0) {
      const Eigen::Vector2d found(values[3 * i], values[3 * i + 1]);
      all.errors.push_back((found - *pixel).norm() * 1000 / camera.height);
    }
  }
}

/// Mean over labels of intersection over union, of labels that the ground truth shows.
double mean_iou(const ByteImage& found, const ByteImage& truth, const std::string& file) {
  if (found.data.size() != truth.data.size()) {
    throw DataError(file, "", "another size than the true labels", "the same size");
  }
  std::array<int, 256> both{};
  std::array<int, 256> either{};
  std::array<int, 256> shown{};
  for (std::size_t p = 0; p < truth.data.size(); ++p) {
    ++shown[truth.data[p]];
    ++either[truth.data[p]];
    if (truth.data[p] == found.data[p]) {
      ++both[truth.data[p]];
    } else {
      ++either[found.data[p]];
    }
  }
  double sum = 0;
  int count = 0;
  for (std::size_t label = 0; label < 256; ++label) {
    if (shown[label] > 0) {
      sum += static_cast<double>(both[label]) / either[label];
      ++count;
    }
  }
  return sum / std::max(1, count);
}

double seam_mismatch(const GroundTruth& truth) {
  double worst = 0;
  for (const GroundTruthGarment& garment : truth.garments) {
    for (const Seam& seam : garment.seams) {
      double a = 0;
      double b = 0;
      for (std::size_t i = 1; i < seam.a.size(); ++i) {
        a += (garment.garment.rest.row(seam.a[i]) - garment.garment.rest.row(seam.a[i - 1])).norm();
        b += (garment.garment.rest.row(seam.b[i]) - garment.garment.rest.row(seam.b[i - 1])).norm();
      }
      if (std::max(a, b) > 0) {
        worst = std::max(worst, std::abs(a - b) / std::max(a, b));
      }
    }
  }
  return worst;
}

}  // namespace

std::vector<Measure> measure_capture(const fs::path& capture) {
  const CaptureInfo info = read_capture_info(capture);
  if (!info.synthetic) {
    throw DataError((capture / "capture.toml").string(), "synthetic", "false",
                    "a synthetic capture: only these have a ground truth");
  }
  const GroundTruth truth = read_ground_truth(capture);
  const KeypointSchema& schema = keypoint_schema(info.keypoint_schema);
  std::vector<Measure> measures = {calibration(truth.cameras, read_cameras(capture))};
  DetectorErrors detections;
  double iou = 0;
  int pictures = 0;
  double deepest = 0;
  const auto thickness = truth.numbers.find("contact_thickness");
  const double room = thickness == truth.numbers.end() ? 0 : thickness->second;
  for (const CaptureSequence& sequence : info.sequences) {
    for (const int id : sequence.frame_ids) {
      const GroundTruthFrame frame = read_ground_truth_frame(capture, truth, id);
      for (const Points& garment : frame.garments) {
        const Eigen::VectorXd depths = depths_inside(garment, frame.body, truth.body.faces, room);
        deepest = std::max(deepest, depths.size() > 0 ? depths.maxCoeff() : 0);
      }
      for (const Camera& camera : truth.cameras) {
        const std::string name = frame_name(id);
        // A frame may have been taken out since, as a bad one is.
        const fs::path points = capture / "keypoints2d" / camera.id / (name + ".json");
        if (fs::exists(points)) {
          add_detections(detections, points, schema, truth, frame, camera);
        }
        const fs::path labels = capture / "labels" / camera.id / (name + ".png");
        if (!fs::exists(labels)) {
          continue;
        }
        iou += mean_iou(read_labels(labels),
                        read_labels(capture / "truth" / "labels" / camera.id / (name + ".png")),
                        labels.string());
        ++pictures;
      }
    }
  }
  if (!detections.errors.empty()) {
    measures.push_back({"capture.keypoint_median_px", median(detections.errors), "px", 0,
                        Measure::Side::None, "found points, at 1000 rows"});
  }
  measures.push_back(
      {"capture.keypoint_found",
       static_cast<double>(detections.errors.size()) / std::max(1, detections.in_picture), "", 0,
       Measure::Side::None, std::to_string(detections.in_picture) + " points in images"});
  measures.push_back({"capture.label_miou", iou / std::max(1, pictures), "", 0, Measure::Side::None,
                      std::to_string(pictures) + " images"});
  measures.push_back(
      {"capture.cloth_depth_mm", 1000 * deepest, "mm", 0.1, Measure::Side::AtMost,
       "largest depth of true cloth inside the body, a thickness off its own overlaps"});
  measures.push_back({"capture.seam_mismatch", seam_mismatch(truth), "", 0.003,
                      Measure::Side::AtMost,
                      "largest relative difference between the two sides of a true seam"});
  return measures;
}

}  // namespace atelier
