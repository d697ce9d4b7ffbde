#include "capture/layouts/join_datasets.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "capture/frame_reader.h"
#include "core/error.h"
#include "core/quantity_text.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

/// What differs between two calibrations of a camera; "" where nothing does.
std::string difference(const Camera& a, const Camera& b) {
  constexpr double kRounding = 1e-6;
  const auto apart = [&](double x, double y, double scale) {
    return std::abs(x - y) > kRounding * std::max(1.0, scale);
  };
  if (a.width != b.width || a.height != b.height) {
    return "images of " + std::to_string(b.width) + " x " + std::to_string(b.height);
  }
  bool lens = a.distortion_model != b.distortion_model || apart(a.fx, b.fx, a.fx) ||
              apart(a.fy, b.fy, a.fy) || apart(a.cx, b.cx, a.fx) || apart(a.cy, b.cy, a.fx);
  for (std::size_t i = 0; i < a.distortion.size(); ++i) {
    lens = lens || apart(a.distortion[i], b.distortion[i], 1);
  }
  if (lens) {
    return "another lens";
  }
  const double moved = (camera_center(a) - camera_center(b)).norm();
  if (moved > kRounding * std::max(1.0, camera_center(a).norm())) {
    return "a place " + short_number(1e3 * moved) + " mm off";
  }
  const double turned =
      (a.camera_from_world_rotation - b.camera_from_world_rotation).cwiseAbs().maxCoeff();
  return turned > kRounding ? "another direction" : "";
}

/// Refuses a part that cannot be read as the first is.
void require_alike(const Dataset& first, const Dataset& part) {
  const std::string file = part.root.string();
  const auto require = [&](const char* what, const std::string& mine, const std::string& theirs) {
    if (mine != theirs) {
      throw DataError(file, what, "'" + theirs + "'",
                      "'" + mine + "', as " + first.root.string() + " has");
    }
  };
  require("layout", first.layout, part.layout);
  require("keypoint schema", first.info.keypoint_schema, part.info.keypoint_schema);
  require("label taxonomy", first.info.label_taxonomy, part.info.label_taxonomy);
  if (!part.info.subject.empty() && !first.info.subject.empty()) {
    require("subject", first.info.subject, part.info.subject);
  }
  if (part.keypoint_file != first.keypoint_file || part.keypoint_shift != first.keypoint_shift) {
    throw DataError(file, "keypoints", "files of another form", "the first part's");
  }
  if (part.info.sequences.size() != 1) {
    throw DataError(file, "sequences", std::to_string(part.info.sequences.size()),
                    "one in each part");
  }
}

/// [C] of the first's cameras, the part's; -1 where it has none of that name.
std::vector<Index> cameras_in_part(const Dataset& first, const Dataset& part) {
  std::vector<Index> of(first.cameras.size(), -1);
  for (std::size_t c = 0; c < first.cameras.size(); ++c) {
    of[c] = camera_index(part, first.cameras[c].id);
    if (of[c] < 0 || !part.calibrated || !first.calibrated) {
      continue;
    }
    const Camera& other = part.cameras[static_cast<std::size_t>(of[c])];
    if (const std::string what = difference(first.cameras[c], other); !what.empty()) {
      throw DataError(part.root.string(), "camera '" + other.id + "'",
                      what + " than in " + first.root.string(),
                      "one rig; where it was calibrated again, convert each part with --cameras "
                      "of one calibration first");
    }
  }
  for (const Camera& camera : part.cameras) {
    if (camera_index(first, camera.id) < 0) {
      throw DataError(part.root.string(), "camera '" + camera.id + "'",
                      "none of that name in " + first.root.string(), "the cameras of one rig");
    }
  }
  return of;
}

/// Adds a part's sequence, its frames `by` higher.
void add_part(Dataset& all, const Dataset& part, const std::vector<Index>& cameras, int by,
              const std::string& name, const std::string& kind) {
  CaptureSequence sequence = part.info.sequences.front();
  sequence.name = name;
  sequence.kind = kind;
  for (int& id : sequence.frame_ids) {
    id += by;
  }
  all.info.sequences.push_back(std::move(sequence));
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (cameras[c] < 0) {
      all.findings.push_back({Severity::Warning, "camera-without-frames", all.cameras[c].id,
                              "the sequence " + name + " does not have it", "it is taken without"});
      continue;
    }
    const CameraFrames& frames = part.frames[static_cast<std::size_t>(cameras[c])];
    CameraFrames& own = all.frames[c];
    if (frames.reading != own.reading || frames.inverted_masks != own.inverted_masks) {
      throw DataError(part.root.string(), "camera '" + all.cameras[c].id + "'",
                      "detections or masks that are read in another way", "the first part's way");
    }
    for (const auto& kinds : {&CameraFrames::images, &CameraFrames::masks, &CameraFrames::labels,
                              &CameraFrames::keypoints}) {
      (own.*kinds).merge((frames.*kinds).shifted(by));
    }
  }
  all.keypoints3d.merge(part.keypoints3d.shifted(by));
  const auto add_new = [](auto& mine, const auto& theirs) {
    for (const auto& one : theirs) {
      if (std::find(mine.begin(), mine.end(), one) == mine.end()) {
        mine.push_back(one);
      }
    }
  };
  add_new(all.info.held_out_cameras, part.info.held_out_cameras);
  for (const int id : part.info.held_out_frames) {
    all.info.held_out_frames.push_back(id + by);
  }
  add_new(all.info.consent, part.info.consent);
}

}  // namespace

Dataset join_datasets(const std::vector<Dataset>& parts, const std::vector<std::string>& kinds) {
  if (parts.size() < 2 || kinds.size() != parts.size()) {
    throw UsageError("--join takes a kind for each of two or more captures, clothed or minimal: " +
                     std::to_string(kinds.size()) + " for " + std::to_string(parts.size()));
  }
  std::map<std::string, int> named;
  Dataset all = parts.front();
  all.info.sequences.clear();
  all.info.held_out_cameras.clear();
  all.info.held_out_frames.clear();
  all.info.synthetic = false;
  for (CameraFrames& frames : all.frames) {
    frames.images.clear();
    frames.masks.clear();
    frames.labels.clear();
    frames.keypoints.clear();
  }
  all.keypoints3d.clear();
  int next = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Dataset& part = parts[p];
    if (kinds[p] != "clothed" && kinds[p] != "minimal") {
      throw UsageError("--join cannot be '" + kinds[p] + "': clothed or minimal");
    }
    require_alike(parts.front(), part);
    const std::vector<int> ids = frame_ids(part);
    const int by = ids.empty() || ids.front() >= next ? 0 : next - ids.front();
    const int count = ++named[kinds[p]];
    const std::string name = kinds[p] + (count > 1 ? "_" + std::to_string(count) : "");
    if (p > 0) {
      all.findings.insert(all.findings.end(), part.findings.begin(), part.findings.end());
      all.info.subject = all.info.subject.empty() ? part.info.subject : all.info.subject;
    }
    add_part(all, part, cameras_in_part(parts.front(), part), by, name, kinds[p]);
    if (by > 0) {
      all.findings.push_back(
          {Severity::Note, "frames-renumbered", part.root.string(),
           "its frames are " + std::to_string(by) + " higher in the sequence " + name,
           "numbers are unique in a capture"});
    }
    next = ids.empty() ? next : ids.back() + by + 1;
  }
  std::sort(all.info.held_out_frames.begin(), all.info.held_out_frames.end());
  return all;
}

bool same_images(const Dataset& a, const Dataset& b) {
  FrameReader read_a(a);
  FrameReader read_b(b);
  bool any = false;
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    const Index other = camera_index(b, a.cameras[c].id);
    const std::vector<int> frames = a.frames[c].images.frames();
    if (other < 0 || frames != b.frames[static_cast<std::size_t>(other)].images.frames()) {
      return false;
    }
    for (std::size_t at = 0; at < 3 && !frames.empty(); ++at) {
      const int frame = frames[at * (frames.size() - 1) / 2];
      try {
        if (read_a.byte_image(static_cast<Index>(c), frame)->data !=
            read_b.byte_image(other, frame)->data) {
          return false;
        }
      } catch (const DataError&) {  // damaged: it tells nothing
        continue;
      }
      any = true;
    }
  }
  return any;
}

}  // namespace atelier
