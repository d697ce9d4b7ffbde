#include "pipeline/capture/reconstruct_stage.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "capture/associate_people.h"
#include "capture/detections.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints3d_file.h"
#include "capture/label_taxonomy.h"
#include "capture/stereo/halved.h"
#include "capture/surface/holes.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"
#include "core/listed_frames.h"
#include "core/mesh_statistics.h"
#include "core/sequence_archive.h"
#include "core/store/frame_left_out.h"
#include "core/store/output_sequences.h"

namespace atelier {
namespace {

/// Advice that names options of a capture, as this stage spells them: "--up" is "--capture.up".
std::string in_section(const std::string& advice) {
  DatasetOptions options;
  std::string text = advice;
  for (const OptionField& field : describe(options).fields) {
    std::string flag = "--" + field.name;
    std::replace(flag.begin() + 2, flag.end(), '_', '-');
    const std::size_t at = text.find(flag);
    if (at != std::string::npos) {
      text.insert(at + 2, "capture.");
    }
  }
  return text;
}

Dataset open_input(const std::filesystem::path& path, const DatasetOptions& options) {
  try {
    Dataset dataset = open_dataset(path, options);
    for (Finding& finding : dataset.findings) {
      finding.advice = in_section(finding.advice);
    }
    return dataset;
  } catch (const DataError& error) {
    throw DataError(error.file, error.where, error.found, in_section(error.expected));
  }
}

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

/// True if a label image of these frames says of a pixel what it is; masks say only where the
/// person is. The first frames may show nobody.
bool has_labels(const Dataset& dataset, const std::vector<int>& frames) {
  FrameReader reader(dataset);
  for (const int frame : frames) {
    for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
      const auto labels = reader.labels(static_cast<Index>(c), frame);
      if (labels && std::any_of(labels->data.begin(), labels->data.end(), [](std::uint8_t label) {
            return label != static_cast<std::uint8_t>(Label::Background) &&
                   label != static_cast<std::uint8_t>(Label::Unknown);
          })) {
        return true;
      }
    }
  }
  return false;
}

bool has_detections(const Dataset& dataset) {
  return std::any_of(dataset.frames.begin(), dataset.frames.end(),
                     [](const CameraFrames& f) { return !f.keypoints.empty(); });
}

void reconstruct_keypoints(StageRun& run, const Dataset& dataset,
                           const TriangulationOptions& options) {
  if (!has_detections(dataset)) {
    run.warn("no detections of 2D keypoints, so none in space; atelier detect creates them");
    return;
  }
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  FrameReader reader(dataset);
  double found = 0;
  double wanted = 0;
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    const Detections detections = read_detections(reader, sequence.frame_ids);
    tell(run, detections.findings, sequence.name + ": ");
    std::vector<std::vector<std::vector<Keypoints2d>>> people = {main_person(detections)};
    if (max_people(detections) > 1) {
      auto apart = associate_people(dataset.cameras, detections, schema, options);
      run.say(sequence.name + ": " + std::to_string(apart.size()) + " people");
      if (!apart.empty()) {
        people = std::move(apart);
      }
    }
    std::vector<std::vector<PersonPose>> frames(sequence.frame_ids.size());
    for (std::size_t p = 0; p < people.size(); ++p) {
      const Triangulation result =
          triangulate(dataset.cameras, people[p], schema, std::max(sequence.fps, 1.0), options);
      tell(run, result.findings, sequence.name + ": ");
      for (std::size_t f = 0; f < result.frames.size(); ++f) {
        PersonPose person{static_cast<int>(p), result.frames[f]};
        const auto there = static_cast<double>(
            std::count_if(person.pose.points.begin(), person.pose.points.end(),
                          [](const SpacePoint& point) { return point.confidence > 0; }));
        if (p == 0) {
          wanted += static_cast<double>(schema.points.size());
          found += there;
        }
        if (p == 0 || there > 0) {
          frames[f].push_back(std::move(person));
        }
      }
    }
    for (std::size_t f = 0; f < frames.size(); ++f) {
      run.output_text("keypoints3d/" + frame_name(sequence.frame_ids[f]) + ".json",
                      keypoints3d_json(frames[f]));
    }
  }
  run.metric("keypoints_found", wanted > 0 ? found / wanted : 0);
}

/// Throws DataError where an image, mask or label image is not as large as the camera says.
void require_size(const char* what, int width, int height, const Camera& camera, int frame,
                  const DataLocation& place) {
  if (width != camera.width || height != camera.height) {
    const auto size = [](int w, int h) { return std::to_string(w) + "x" + std::to_string(h); };
    throw DataError(place.file.string(), "camera " + camera.id + ", frame " + std::to_string(frame),
                    std::string(what) + " of " + size(width, height) + " pixels",
                    size(camera.width, camera.height) + ", as the camera has");
  }
}

/// Of one camera's frames, those without an image or without a mask.
std::optional<Finding> missing_of(const std::string& camera, const CameraFrames& files,
                                  const std::vector<int>& frames) {
  std::size_t pictures = 0;
  std::vector<int> without;
  for (const int frame : frames) {
    pictures += files.images.contains(frame) ? 1 : 0;
    if (!files.images.contains(frame) ||
        (!files.masks.contains(frame) && !files.labels.contains(frame))) {
      without.push_back(frame);
    }
  }
  const std::string all = std::to_string(frames.size());
  const auto finding = [&](std::string what, std::string advice) {
    return Finding{Severity::Warning, "view-missing", camera, std::move(what), std::move(advice)};
  };
  if (without.empty()) {
    return std::nullopt;
  }
  if (pictures == 0) {
    return finding("no image of any of the " + all + " frames",
                   "it is not used; check the location and the names of its images");
  }
  if (without.size() == frames.size()) {
    return finding("no mask and no labels of any of its images",
                   "it is not used; atelier masks creates masks");
  }
  return finding("no image or no mask in " + std::to_string(without.size()) + " of " + all +
                     " frames, the first of them " + std::to_string(without.front()),
                 "its other frames are used");
}

/// Frames that a camera has an image or a mask of.
std::vector<int> taken_frames(const Dataset& dataset) {
  std::vector<int> frames = frame_ids(dataset);
  std::erase_if(frames, [&](int frame) {
    return std::none_of(dataset.frames.begin(), dataset.frames.end(),
                        [&](const CameraFrames& camera) {
                          return camera.images.contains(frame) || camera.masks.contains(frame) ||
                                 camera.labels.contains(frame);
                        });
  });
  return frames;
}

/// Missing parts of the capture's frames, as far as they are worked on: views without an image or a
/// mask, and frames that have too few of them.
std::vector<Finding> missing_views(const Dataset& dataset, const std::vector<int>& frames) {
  std::vector<Finding> findings;
  for (std::size_t c = 0; c < dataset.cameras.size() && !frames.empty(); ++c) {
    if (auto finding = missing_of(dataset.cameras[c].id, dataset.frames[c], frames)) {
      findings.push_back(std::move(*finding));
    }
  }
  std::vector<int> dropped = taken_frames(dataset);
  std::erase_if(dropped,
                [&](int frame) { return std::binary_search(frames.begin(), frames.end(), frame); });
  if (!dropped.empty() && !frames.empty()) {
    const bool one = dropped.size() == 1;
    findings.push_back(
        {Severity::Warning, "frame-without-masks",
         (one ? "frame " : "frames ") + listed_frames(dropped),
         "images with masks or labels of fewer than two cameras",
         std::string(one ? "it gets" : "they get") + " no surface; atelier masks creates masks"});
  }
  return findings;
}

/// Counts frames that get no surface, from several threads, and refuses more than the option
/// allows.
class LeftOutFrames {
 public:
  /// @param before  frames that are known to have too few views
  LeftOutFrames(std::string capture, std::size_t before, std::size_t all, double max_share)
      : capture_(std::move(capture)), left_out_(before), all_(all), max_share_(max_share) {}

  /// One more, and why. Throws DataError where it is one too many.
  void add(int frame, const DataError& reason) {
    require_few(++left_out_, "frame " + std::to_string(frame) + ", " + reason.where,
                reason.found + "; ", reason.expected + "; ");
  }

  /// All of them, with those of other runs.
  void require_few(std::size_t count, const std::string& where = "frames",
                   const std::string& reason = "", const std::string& advice = "") const {
    if (count > 0 &&
        (count == all_ || static_cast<double>(count) > max_share_ * static_cast<double>(all_))) {
      char expected[80];
      std::snprintf(expected, sizeof(expected), "at most a share of %.3g (--max-left-out)",
                    max_share_);
      throw DataError(capture_, where,
                      reason + std::to_string(count) + " of " + std::to_string(all_) +
                          (all_ == 1 ? " frame" : " frames") + (count == 1 ? " gets" : " get") +
                          " no surface",
                      advice + (count == all_ ? "one surface at least" : expected));
    }
  }

 private:
  std::string capture_;
  std::atomic<std::size_t> left_out_;
  std::size_t all_;
  double max_share_;
};

/// The surface of a frame, or the finding that there is none.
Mesh frame_surface(StageRun& run, const Dataset& dataset, int frame, int halvings, bool by_color,
                   LeftOutFrames& left_out) {
  const auto& options = run.options<ReconstructStageOptions>();
  const std::string whose = "frame " + std::to_string(frame) + ": ";
  try {
    ReconstructedScan scan =
        reconstruct_scan(instant_of(dataset, frame, halvings), options.scan, run.device());
    std::optional<ColorSplit> split;
    if (by_color) {
      split = split_by_color(scan.scan, options.split);
    }
    tell(run, scan.findings, whose);
    if (split) {
      tell(run, split->findings, whose);
      scan.scan.labels = std::move(split->labels);
    }
    return std::move(scan.scan);
  } catch (const DataError& error) {
    if (!error.file.empty()) {
      throw;
    }
    left_out.add(frame, error);
    run.warn(
        to_string(Finding{Severity::Warning, "frame-left-out", "frame " + std::to_string(frame),
                          error.where + ": " + error.found + " (expected: " + error.expected + ")",
                          "it gets no surface"}));
    throw FrameLeftOut();
  }
}

/// Where each scan is open: its loops' centres, lengths and areas, the largest first.
void map_holes(StageRun& run, const std::vector<int>& frames) {
  if (frames.empty()) {
    return;
  }
  nlohmann::json all = nlohmann::json::object();
  double surface = 0;
  double open = 0;
  for (const int frame : frames) {
    const Mesh scan = read_mesh_archive(run.frame_file(frame));
    surface += mesh_statistics(scan).area;
    nlohmann::json& list = all[frame_name(frame)] = nlohmann::json::array();
    for (const Hole& hole : find_holes(scan)) {
      open += hole.area;
      list.push_back({{"centre", {hole.centre.x(), hole.centre.y(), hole.centre.z()}},
                      {"length", hole.length},
                      {"area", hole.area}});
    }
  }
  run.output_text("holes.json", all.dump(1));
  run.metric("hole_share", surface + open > 0 ? open / (surface + open) : 0);
}

}  // namespace

Dataset stage_dataset(const std::filesystem::path& path, const DatasetOptions& options) {
  Dataset dataset = without_held_out(open_input(path, options));
  if (!dataset.calibrated) {
    throw DataError(path.string(), "", "cameras without calibration",
                    "calibrated ones; atelier validate says more");
  }
  if (dataset.cameras.size() < 2) {
    throw DataError(path.string(), "cameras",
                    std::to_string(dataset.cameras.size()) + " that a stage may use",
                    "at least two, held-out and left-out ones not counted");
  }
  return dataset;
}

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

int halvings_for(const Dataset& dataset, double gibibytes) {
  constexpr double kGibibyte = 1073741824;
  constexpr double kBytesPerPixel = 125;  // measured; what does not grow with images is little
  constexpr int kMost = 4;
  double bytes = 0;
  for (const Camera& camera : dataset.cameras) {
    bytes += kBytesPerPixel * camera.width * camera.height;
  }
  int halvings = 0;
  for (; bytes > gibibytes * kGibibyte && halvings < kMost; ++halvings) {
    bytes /= 4;
  }
  return halvings;
}

std::string halvings_text(int halvings, double gibibytes) {
  char text[200];
  std::snprintf(text, sizeof(text),
                "images are taken at 1/%d of their size, so that those of a frame take %.3g GiB "
                "at most where four halvings do it (--memory)",
                1 << halvings, gibibytes);
  return text;
}

std::vector<InstantView> instant_of(const Dataset& dataset, int frame, int halvings) {
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
    const CameraFrames& files = dataset.frames[c];
    require_size("an image", view.image.width, view.image.height, view.camera, frame,
                 *files.images.find(frame));
    if (auto labels = reader.labels(index, frame)) {
      view.labels = std::move(*labels);
      require_size("a label image", view.labels.width, view.labels.height, view.camera, frame,
                   *files.labels.find(frame));
    }
    require_size(
        "a mask", view.mask.width, view.mask.height, view.camera, frame,
        files.masks.contains(frame) ? *files.masks.find(frame) : *files.labels.find(frame));
    for (int i = 0; i < halvings; ++i) {
      view.camera = halved(view.camera);
      view.image = halved(view.image);
      view.mask = halved(view.mask);
      view.labels = view.labels.data.empty() ? ByteImage{} : halved(view.labels);
    }
    views.push_back(std::move(view));
  }
  return views;
}

OptionTable describe(ReconstructStageOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  table.add("keypoints", describe(options.keypoints));
  table.add(describe(options.scan));
  table.add("label_by_color", options.label_by_color,
            "Segmentation into skin and clothing by colour where there are no label images");
  table.add("split", describe(options.split));
  table.add("max_left_out", options.max_left_out, 0, 1, "",
            "Maximum share of the frames that may be left without a surface (no subject, too few "
            "views or masks); 0 refuses the first");
  table.add("memory", options.memory, 0.01, 4096, "GiB",
            "Memory for one frame, of which --jobs frames are processed at once; images are halved "
            "in size until it suffices");
  return table;
}

void run_reconstruct(StageRun& run) {
  const auto& options = run.options<ReconstructStageOptions>();
  const Dataset dataset = stage_dataset(run.input("capture"), options.capture);
  tell(run, dataset.findings);
  const std::vector<int> frames = frames_with_masks(dataset);
  if (frames.empty() && !has_detections(dataset)) {
    throw DataError(run.input("capture").string(), "",
                    "neither masks nor labels in two views of a frame, and no detections",
                    "some of them; atelier masks and atelier detect create them");
  }
  if (frames.empty()) {
    run.warn(
        "no frame has masks or labels of two cameras, so there are no surfaces; atelier masks "
        "creates masks");
  }
  const bool by_color = options.label_by_color && !frames.empty() && !has_labels(dataset, frames);
  tell(run, missing_views(dataset, frames));
  const std::size_t taken = taken_frames(dataset).size();
  const std::size_t without_masks = taken - frames.size();
  LeftOutFrames left_out(run.input("capture").string(), without_masks, taken, options.max_left_out);
  if (!frames.empty()) {
    left_out.require_few(without_masks, "frames", "", "images with masks in two views of each; ");
  }
  const int halvings = halvings_for(dataset, options.memory);
  if (halvings > 0) {
    run.say(halvings_text(halvings, options.memory));
  }
  if (!output_sequences(run, {{"scans", std::nullopt}}, frames, [&](int frame) {
        return std::vector<Archive>{
            archive_of(frame_surface(run, dataset, frame, halvings, by_color, left_out))};
      })) {
    return;
  }
  std::vector<int> scanned = frames;
  std::erase_if(scanned,
                [&](int frame) { return !std::filesystem::exists(run.frame_file(frame)); });
  const std::size_t without = without_masks + frames.size() - scanned.size();
  if (!frames.empty()) {
    left_out.require_few(without);
  }
  reconstruct_keypoints(run, dataset, options.keypoints);
  map_holes(run, scanned);
  run.metric("labels_by_color", by_color ? 1 : 0);
  run.metric("scans", static_cast<double>(scanned.size()));
  run.metric("frames_left_out", frames.empty() ? 0 : static_cast<double>(without));
  run.metric("cameras", static_cast<double>(dataset.cameras.size()));
}

}  // namespace atelier
