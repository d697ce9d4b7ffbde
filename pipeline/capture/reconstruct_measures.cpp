#include "pipeline/capture/reconstruct_measures.h"

#include <algorithm>
#include <string>

#include "capture/capture_fabric.h"
#include "capture/capture_info.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "capture/label_taxonomy.h"
#include "capture/surface/surface_error.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

constexpr double kNothing = 0.001;  // of the area: what still counts as nothing floating

/// The result's folder, or nothing.
std::filesystem::path result_in(const std::filesystem::path& workspace) {
  return workspace / "reconstruct" / "current";
}

Mesh joined_truth(const GroundTruth& truth, const GroundTruthFrame& frame) {
  Mesh all;
  const auto add = [&](const Points& vertices, const Triangles& faces, Label label) {
    if (vertices.rows() == 0) {
      return;
    }
    const Index v = all.vertices.rows();
    const Index f = all.faces.rows();
    all.vertices.conservativeResize(v + vertices.rows(), 3);
    all.vertices.bottomRows(vertices.rows()) = vertices;
    all.faces.conservativeResize(f + faces.rows(), 3);
    all.faces.bottomRows(faces.rows()) = faces.array() + static_cast<int>(v);
    all.labels.insert(all.labels.end(), static_cast<std::size_t>(vertices.rows()),
                      static_cast<std::uint8_t>(label));
  };
  add(frame.body, truth.body.faces, Label::Skin);
  for (std::size_t i = 0; i < frame.layers.size(); ++i) {
    const Label label = truth.layer_names[i] == "hair"    ? Label::Hair
                        : truth.layer_names[i] == "shoes" ? Label::Shoes
                                                          : Label::Other;
    add(frame.layers[i], truth.layers[i].faces, label);
  }
  for (std::size_t i = 0; i < frame.garments.size(); ++i) {
    add(frame.garments[i], truth.garments[i].garment.mesh.faces, truth.garments[i].label);
  }
  return all;
}

void measure_keypoints(const std::filesystem::path& result, const std::filesystem::path& capture,
                       const GroundTruth& truth, const CaptureInfo& info,
                       std::vector<Measure>& measures) {
  const KeypointSchema& schema = keypoint_schema(info.keypoint_schema);
  double sum = 0;
  double found = 0;
  double wanted = 0;
  for (const CaptureSequence& sequence : info.sequences) {
    for (const int id : sequence.frame_ids) {
      const std::filesystem::path file = result / "keypoints3d" / (frame_name(id) + ".json");
      if (!std::filesystem::exists(file)) {
        continue;
      }
      const auto people = parse_keypoints3d(read_file_text(file, 1 << 24), file.string());
      const GroundTruthFrame frame = read_ground_truth_frame(capture, truth, id);
      for (std::size_t row = 0; row < truth.keypoint_names.size(); ++row) {
        const Index k = find_keypoint(schema, truth.keypoint_names[row]);
        if (k < 0) {
          continue;  // the ground truth has more points than detectors look for
        }
        wanted += 1;
        if (!people.empty() && people[0].points.rows() > k && people[0].points(k, 3) > 0) {
          found += 1;
          sum += (people[0].points.row(k).head<3>() - frame.keypoints.row(static_cast<Index>(row)))
                     .norm();
        }
      }
    }
  }
  if (found > 0) {
    measures.push_back({"keypoints.mean_mm", 1e3 * sum / found, "mm", 5, Measure::Side::AtMost,
                        "mean error of the keypoints that were found"});
    measures.push_back(
        {"keypoints.found", found / wanted, "", 0, Measure::Side::None, "share of the keypoints"});
  }
}

/// Those that a stage may open.
std::vector<Camera> open_cameras(const GroundTruth& truth, const CaptureInfo& info) {
  std::vector<Camera> cameras;
  for (const Camera& camera : truth.cameras) {
    if (std::find(info.held_out_cameras.begin(), info.held_out_cameras.end(), camera.id) ==
        info.held_out_cameras.end()) {
      cameras.push_back(camera);
    }
  }
  return cameras;
}

/// mm: plain cloth has little for stereo to find again.
double chamfer_target(const std::filesystem::path& capture) {
  return capture_fabric(capture) == "plain" ? 4 : 2.5;
}

}  // namespace

std::vector<Measure> measure_surface(const std::filesystem::path& mesh, int frame,
                                     const std::filesystem::path& capture) {
  const GroundTruth truth = read_ground_truth(capture);
  const Mesh surface = joined_truth(truth, read_ground_truth_frame(capture, truth, frame));
  const SurfaceSamples seen =
      seen_surface(surface, open_cameras(truth, read_capture_info(capture)), 0.007);
  const SurfaceError error = surface_error(read_mesh(mesh), surface, seen);
  return {{"surface.chamfer_mm", 1e3 * error.chamfer, "mm", chamfer_target(capture),
           Measure::Side::AtMost, "of " + mesh.filename().string()},
          {"surface.completeness", error.completeness, "", 0.95, Measure::Side::AtLeast,
           "share within 5 mm of what two cameras see"},
          {"surface.floating", error.floating, "", kNothing, Measure::Side::AtMost,
           "share of its area more than 2 cm off"}};
}

std::vector<Measure> measure_reconstruct(const std::filesystem::path& workspace,
                                         const std::filesystem::path& capture) {
  const std::filesystem::path result = result_in(workspace);
  std::vector<Measure> measures;
  if (!std::filesystem::exists(result)) {
    return measures;
  }
  const GroundTruth truth = read_ground_truth(capture);
  const CaptureInfo info = read_capture_info(capture);
  measure_keypoints(result, capture, truth, info, measures);
  const std::vector<Camera> cameras = open_cameras(truth, info);
  SurfaceError mean;
  std::map<std::uint8_t, std::pair<double, int>> of_label;  // sum of shares, scans
  double unseen = 0;
  int count = 0;
  for (const CaptureSequence& sequence : info.sequences) {
    for (const int id : sequence.frame_ids) {
      const std::filesystem::path file = result / "scans" / (frame_name(id) + ".h5");
      if (!std::filesystem::exists(file)) {
        continue;
      }
      const Mesh surface = joined_truth(truth, read_ground_truth_frame(capture, truth, id));
      const SurfaceSamples seen = seen_surface(surface, cameras, 0.007);
      const SurfaceError error = surface_error(read_mesh_archive(file), surface, seen);
      mean.chamfer += error.chamfer;
      mean.completeness += error.completeness;
      mean.floating += error.floating;
      mean.label_iou += error.label_iou;
      for (const auto& [label, share] : error.completeness_of) {
        of_label[label].first += share;
        ++of_label[label].second;
      }
      unseen += 1 - seen.seen_area / seen.area;
      ++count;
    }
  }
  if (count > 0) {
    const std::string over = "mean over " + std::to_string(count) + " scans";
    measures.push_back({"surface.chamfer_mm", 1e3 * mean.chamfer / count, "mm",
                        chamfer_target(capture), Measure::Side::AtMost, over});
    measures.push_back({"surface.completeness", mean.completeness / count, "", 0.95,
                        Measure::Side::AtLeast, "share within 5 mm of what two cameras see"});
    for (const auto& [label, sum] : of_label) {
      measures.push_back({"surface.completeness." + label_name(static_cast<Label>(label)),
                          sum.first / sum.second, "", 0, Measure::Side::None, "the part of it"});
    }
    measures.push_back({"surface.floating", mean.floating / count, "", kNothing,
                        Measure::Side::AtMost, "share of the scans' area more than 2 cm off"});
    measures.push_back({"surface.unseen", unseen / count, "", 0, Measure::Side::None,
                        "share of the true area that no two cameras see"});
    measures.push_back({"labels.miou", mean.label_iou / count, "", 0.95, Measure::Side::AtLeast,
                        "over the seen surface"});
  }
  return measures;
}

}  // namespace atelier
