#include "pipeline/person/track_stage.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/humanoid.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/io/text_writer.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/unknown_value.h"
#include "pipeline/pictures/person_pictures.h"

namespace atelier {
namespace {

/// [V] 1 over the named group or the vertices of a JSON list.
std::vector<char> painted_region(const BodyModel& model, const std::string& name) {
  std::vector<char> region(static_cast<std::size_t>(vertex_count(model)), 0);
  const auto group = std::find_if(model.groups.begin(), model.groups.end(),
                                  [&](const VertexGroup& one) { return one.name == name; });
  if (group != model.groups.end()) {
    for (const int v : group->vertices) {
      region[static_cast<std::size_t>(v)] = 1;
    }
    return region;
  }
  if (name.empty() || !std::filesystem::exists(name)) {
    std::string groups;
    for (const VertexGroup& known : model.groups) {
      groups += ", " + known.name;
    }
    throw UnknownValue("", "region", name,
                       "a file with a JSON list of vertices or one of the body's groups: " +
                           (groups.empty() ? "it has none" : groups.substr(2)));
  }
  constexpr std::size_t kMaxText = 1 << 26;
  const std::string text = read_file_text(name, kMaxText);
  const nlohmann::json parsed = parse_json(text, name);
  const JsonPlace place(parsed, name);
  for (const double value : place.numbers()) {
    if (!(value >= 0 && value < static_cast<double>(region.size())) ||
        value != static_cast<double>(saturating_cast<Index>(value))) {
      throw DataError(name, "region", number_text(value),
                      "vertices of the body, 0 to " + std::to_string(region.size() - 1));
    }
    region[saturating_cast<std::size_t>(value)] = 1;
  }
  if (std::find(region.begin(), region.end(), 1) == region.end()) {
    throw DataError(name, "region", "no vertex", "at least one; --exclude none leaves nothing out");
  }
  return region;
}

/// Writes the images of a sequence for the report: the region left out, every frame's errors.
void write_pictures(StageRun& run, const std::string& name, const BodyModel& model,
                    const TrackedMotion& tracked) {
  const auto output = [&](const std::string& path, const Image& picture) {
    run.output_text(path, image_bytes(picture, ImageFormat::Png));
  };
  if (!tracked.region.empty()) {
    const double share =
        static_cast<double>(tracked.region.size()) / static_cast<double>(vertex_count(model));
    output("pictures/" + name + "_region.png",
           region_picture(model, tracked.region,
                          "clothing over this " + percent(share) + " of the body does not count"));
  }
  const auto millimetres = [](const Eigen::VectorXd& metres) {
    std::vector<double> values(metres.data(), metres.data() + metres.size());
    for (double& value : values) {
      value *= 1e3;
    }
    return values;
  };
  output(
      "pictures/" + name + "_frames.png",
      frames_picture(
          tracked.motion.frame_ids, tracked.trusted,
          {{"standard deviation of joints, mm", millimetres(tracked.deviations.rowwise().mean())},
           {"keypoints, mm rms", millimetres(tracked.keypoint_rms)},
           {"scan, mm rms", millimetres(tracked.scan_rms)},
           {"share of the scan that counted",
            {tracked.scan_share.data(), tracked.scan_share.data() + tracked.scan_share.size()}}}));
}

/// Sums over frames of what tracking says of itself.
struct TrackSums {
  double frames = 0;
  double trusted = 0;
  double keypoints = 0;
  double scans = 0;
  double scanned = 0;
  double deviation = 0;
  bool found = false;  // some frame has keypoints that agree, or a scan that says as much
};

void add(TrackSums& sums, const TrackedMotion& tracked) {
  const auto count = static_cast<double>(tracked.trusted.size());
  sums.frames += count;
  sums.trusted +=
      static_cast<double>(std::count(tracked.trusted.begin(), tracked.trusted.end(), 1));
  sums.keypoints += tracked.keypoint_rms.sum();
  sums.scans += tracked.scan_rms.sum();
  sums.scanned += static_cast<double>((tracked.scan_share.array() > 0).count());
  sums.deviation += tracked.deviations.mean() * count;
  sums.found = sums.found || tracked.keypoint_rms.maxCoeff() > 0 ||
               std::count(tracked.trusted.begin(), tracked.trusted.end(), 1) > 0;
}

/// Sum over frames of the mean distance of hips, knees and ankles between two trackings.
double legs_moved(const TrackedMotion& a, const TrackedMotion& b) {
  double sum = 0;
  for (const Leg& leg : recognised_humanoid(a.skeleton).legs) {
    for (const int joint : {leg.hip, leg.knee, leg.ankle}) {
      for (std::size_t f = 0; f < a.joints.size(); ++f) {
        sum += (a.joints[f].row(joint) - b.joints[f].row(joint)).norm() / 6;
      }
    }
  }
  return sum;
}

}  // namespace

OptionTable describe(TrackStageOptions& options) {
  OptionTable table;
  table.add("input", describe(options.input));
  table.add("input.excluded", options.input.excluded, std::vector<std::string>{},
            "Labels, separated by commas, whose clothing exclude = labels leaves out");
  table.add(describe(options.fit));
  table.add("region", options.region, std::vector<std::string>{},
            "Vertex group of the body or JSON list of vertices for exclude = region");
  table.add("compare", options.compare,
            "Second tracking run with no clothing left out, which reports its errors for "
            "comparison; doubles the time");
  return table;
}

void require_trackable(const TrackStageOptions& options, const std::filesystem::path& workspace) {
  require_person(workspace, options.input);
  const std::filesystem::path person = workspace / "personalize" / "current" / "person.npz";
  if (options.fit.exclude == Exclude::Region && !workspace.empty() &&
      std::filesystem::exists(person)) {
    painted_region(read_personal_body(person).model, options.region);
  }
}

void run_track(StageRun& run) {
  const auto& options = run.options<TrackStageOptions>();
  const CaptureInfo info = person_capture(person_files(run), options.input);
  const PersonalBody person = read_personal_body(run.input("person") / "person.npz");
  const std::vector<Label> excluded = options.fit.exclude == Exclude::Labels
                                          ? labels_of(options.input.excluded)
                                          : std::vector<Label>{};
  TrackSums sums;
  TrackSums without;  // exclusion
  double moved = 0;
  double compared = 0;  // frames
  double region = 0;
  for (const CaptureSequence& sequence : info.sequences) {
    if (sequence.frame_ids.empty()) {
      continue;
    }
    PersonEvidence evidence =
        person_input(person_files(run), info, sequence, options.input, excluded);
    tell(run, evidence.findings, sequence.name + ": ");
    TrackInput& input = evidence.input;
    if (options.fit.exclude == Exclude::Region) {
      input.region = painted_region(person.model, options.region);
    }
    TrackOptions fit = options.fit;
    if (sequence.kind == "minimal" && fit.exclude == Exclude::Auto) {
      fit.exclude = Exclude::None;  // nothing hangs there
    }
    const Tracking found = track(person.model, input, fit);
    tell(run, found.findings, sequence.name + ": ");
    const TrackedMotion& tracked = found.tracked;
    run.output("tracked/" + sequence.name + ".h5",
               [&](const std::filesystem::path& file) { write_tracked_motion(file, tracked); });
    MotionClip clip;
    clip.name = sequence.name;
    clip.skeleton = tracked.skeleton;
    clip.motion = tracked.motion;
    run.output("motion/" + sequence.name + ".npz",
               [&](const std::filesystem::path& file) { write_motion(file, clip); });
    write_pictures(run, sequence.name, person.model, tracked);
    add(sums, tracked);
    if (options.compare && !tracked.region.empty()) {
      fit.exclude = Exclude::None;
      input = person_input(person_files(run), info, sequence, options.input).input;
      const TrackedMotion all = track(person.model, input, fit).tracked;
      add(without, all);
      moved += legs_moved(tracked, all);
      compared += static_cast<double>(all.joints.size());
    } else {
      add(without, tracked);
    }
    region = std::max(region, static_cast<double>(tracked.region.size()) /
                                  static_cast<double>(vertex_count(person.model)));
  }
  if (sums.frames == 0) {
    throw DataError(run.input("capture").string(), "sequences", "no frame", "at least one");
  }
  if (!sums.found) {
    throw DataError(run.input("keypoints3d").string(), "keypoints3d",
                    "no frame that shows a person, and no scan of one",
                    "at least one frame with hips, shoulders and limbs");
  }
  run.metric("frames", sums.frames);
  run.metric("trusted_share", sums.trusted / sums.frames);
  run.metric("keypoint_rms", sums.keypoints / sums.frames);
  if (sums.scanned > 0) {  // frames without a scan are none that it fits
    run.metric("scan_rms", sums.scans / sums.scanned);
  }
  run.metric("deviation_mean", sums.deviation / sums.frames);
  run.metric("region_share", region);
  if (compared > 0) {
    run.metric("keypoint_rms_none", without.keypoints / without.frames);
    if (without.scanned > 0) {
      run.metric("scan_rms_none", without.scans / without.scanned);
    }
    run.metric("legs_moved_none", moved / compared);
  }
}

}  // namespace atelier
