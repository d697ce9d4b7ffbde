#ifdef ATELIER_HAS_CAPTURE_SURFACE

#include "apps/reconstruct_stage.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>

#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "capture/surface/surface_error.h"
#include "capture/truth_archive.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/sequence_archive.h"

namespace atelier {
namespace {

/// Without the cameras that no stage may open.
Dataset without_held_out(Dataset dataset) {
  const std::set<std::string> held(dataset.info.held_out_cameras.begin(),
                                   dataset.info.held_out_cameras.end());
  Dataset rest = dataset;
  rest.cameras.clear();
  rest.frames.clear();
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (!held.contains(dataset.cameras[c].id)) {
      rest.cameras.push_back(dataset.cameras[c]);
      rest.frames.push_back(std::move(dataset.frames[c]));
    }
  }
  return rest;
}

/// Frames of which at least two cameras have a picture with a mask.
std::vector<int> frames_with_masks(const Dataset& dataset) {
  std::vector<int> frames;
  for (const int frame : frame_ids(dataset)) {
    int views = 0;
    for (const CameraFrames& camera : dataset.frames) {
      views += camera.images.contains(frame) &&
                       (camera.masks.contains(frame) || camera.labels.contains(frame))
                   ? 1
                   : 0;
    }
    if (views >= 2) {
      frames.push_back(frame);
    }
  }
  return frames;
}

std::vector<InstantView> instant(const Dataset& dataset, int frame) {
  FrameReader reader(dataset);
  std::vector<InstantView> views;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const auto index = static_cast<Index>(c);
    auto image = reader.image(index, frame);
    auto mask = reader.mask(index, frame);
    if (!image || !mask) {
      continue;
    }
    if (image->channels == 1) {
      Image colour(image->width, image->height, 3);
      for (std::size_t i = 0; i < colour.data.size(); ++i) {
        colour.data[i] = image->data[i / 3];
      }
      image = std::move(colour);
    }
    InstantView view;
    view.camera = dataset.cameras[c];
    view.image = std::move(*image);
    view.mask = std::move(*mask);
    if (auto labels = reader.labels(index, frame)) {
      view.labels = std::move(*labels);
    }
    views.push_back(std::move(view));
  }
  return views;
}

std::string frame_file(int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d", frame);
  return name;
}

void reconstruct_keypoints(StageRun& run, const Dataset& dataset,
                           const TriangulationOptions& options) {
  const bool any = std::any_of(dataset.frames.begin(), dataset.frames.end(),
                               [](const CameraFrames& f) { return !f.keypoints.empty(); });
  if (!any) {
    run.say("no detections: no keypoints in space");
    return;
  }
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  FrameReader reader(dataset);
  double found = 0;
  double wanted = 0;
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    const auto detections = main_person(reader, sequence.frame_ids);
    const Triangulation result =
        triangulate(dataset.cameras, detections, schema, std::max(sequence.fps, 1.0), options);
    for (const Finding& finding : result.findings) {
      run.say(sequence.name + ": " + to_string(finding));
    }
    for (std::size_t f = 0; f < result.frames.size(); ++f) {
      PersonPoints person;
      person.id = 0;
      person.points = Keypoints3d::Zero(static_cast<Index>(schema.points.size()), 4);
      for (std::size_t k = 0; k < schema.points.size(); ++k) {
        const SpacePoint& point = result.frames[f].points[k];
        wanted += 1;
        if (point.confidence > 0) {
          found += 1;
          person.points.row(static_cast<Index>(k)) << point.place.transpose(), point.confidence;
        }
      }
      run.output_text("keypoints3d/" + frame_file(sequence.frame_ids[f]) + ".json",
                      keypoints3d_json({person}));
    }
  }
  run.metric("keypoints_found", wanted > 0 ? found / wanted : 0);
}

/// The result's folder, or nothing.
std::filesystem::path result_in(const std::filesystem::path& workspace) {
  return workspace / "reconstruct" / "current";
}

Mesh joined_truth(const CaptureTruth& truth, const TruthFrame& frame) {
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
                       const CaptureTruth& truth, const CaptureInfo& info,
                       std::vector<Measure>& measures) {
  const KeypointSchema& schema = keypoint_schema(info.keypoint_schema);
  double sum = 0;
  double found = 0;
  double wanted = 0;
  for (const CaptureSequence& sequence : info.sequences) {
    for (const int id : sequence.frame_ids) {
      const std::filesystem::path file = result / "keypoints3d" / (frame_file(id) + ".json");
      if (!std::filesystem::exists(file)) {
        continue;
      }
      const auto people = parse_keypoints3d(read_file_text(file, 1 << 24), file.string());
      const TruthFrame frame = read_truth_frame(capture, truth, id);
      for (std::size_t row = 0; row < truth.keypoint_names.size(); ++row) {
        const Index k = find_keypoint(schema, truth.keypoint_names[row]);
        if (k < 0) {
          continue;  // the truth has more points than detectors look for
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

}  // namespace

OptionTable describe(ReconstructStageOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  table.add("keypoints", describe(options.keypoints));
  table.add(describe(options.scan));
  return table;
}

void run_reconstruct(StageRun& run) {
  const auto& options = run.options<ReconstructStageOptions>();
  const Dataset dataset = without_held_out(open_dataset(run.input("capture"), options.capture));
  if (!dataset.calibrated) {
    throw DataError(run.input("capture").string(), "", "cameras without calibration",
                    "calibrated ones; atelier validate says more");
  }
  for (const Finding& finding : dataset.findings) {
    run.say(to_string(finding));
  }
  const std::vector<int> frames = frames_with_masks(dataset);
  if (frames.empty()) {
    run.say("no masks and no labels: no surfaces");
  }
  if (!run.each_frame("scans", ".h5", frames, [&](int frame, const std::filesystem::path& file) {
        const ReconstructedScan scan =
            reconstruct_scan(instant(dataset, frame), options.scan, run.device());
        for (const Finding& finding : scan.findings) {
          run.say("frame " + std::to_string(frame) + ": " + to_string(finding));
        }
        write_mesh_archive(file, scan.scan);
      })) {
    return;
  }
  reconstruct_keypoints(run, dataset, options.keypoints);
  run.metric("scans", static_cast<double>(frames.size()));
  run.metric("cameras", static_cast<double>(dataset.cameras.size()));
}

std::vector<Measure> measure_reconstruct(const std::filesystem::path& workspace,
                                         const std::filesystem::path& capture) {
  const std::filesystem::path result = result_in(workspace);
  std::vector<Measure> measures;
  if (!std::filesystem::exists(result)) {
    return measures;
  }
  const CaptureTruth truth = read_capture_truth(capture);
  const CaptureInfo info = read_capture_info(capture);
  measure_keypoints(result, capture, truth, info, measures);
  SurfaceError mean;
  double unseen = 0;
  int count = 0;
  for (const CaptureSequence& sequence : info.sequences) {
    for (const int id : sequence.frame_ids) {
      const std::filesystem::path file = result / "scans" / (frame_file(id) + ".h5");
      if (!std::filesystem::exists(file)) {
        continue;
      }
      const Mesh surface = joined_truth(truth, read_truth_frame(capture, truth, id));
      const SurfaceSamples seen = seen_surface(surface, truth.cameras, 0.007);
      const SurfaceError error = surface_error(read_mesh_archive(file), surface, seen);
      mean.chamfer += error.chamfer;
      mean.completeness += error.completeness;
      mean.floating += error.floating;
      mean.label_iou += error.label_iou;
      unseen += 1 - seen.seen_area / seen.area;
      ++count;
    }
  }
  if (count > 0) {
    const std::string over = "mean over " + std::to_string(count) + " scans";
    measures.push_back(
        {"surface.chamfer_mm", 1e3 * mean.chamfer / count, "mm", 2.5, Measure::Side::AtMost, over});
    measures.push_back({"surface.completeness", mean.completeness / count, "", 0.95,
                        Measure::Side::AtLeast, "share within 5 mm of what two cameras see"});
    measures.push_back({"surface.floating", mean.floating / count, "", 0, Measure::Side::None,
                        "share of the scans' area more than 2 cm off"});
    measures.push_back({"surface.unseen", unseen / count, "", 0, Measure::Side::None,
                        "share of the true area that no two cameras see"});
    measures.push_back({"labels.miou", mean.label_iou / count, "", 0.95, Measure::Side::AtLeast,
                        "over the seen surface"});
  }
  return measures;
}

}  // namespace atelier

#endif
