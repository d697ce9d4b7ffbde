#include "capture/check_keypoints.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "capture/associate_people.h"
#include "capture/detections.h"
#include "capture/explain_cameras.h"
#include "capture/explain_rig.h"
#include "capture/keypoint_schema.h"
#include "capture/sentence.h"
#include "core/median.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kWorstError = 12;  // px of an image 1000 rows high: no detector is so far off

using Frames = std::vector<std::vector<Keypoints2d>>;

/// Frames of which some camera has detections. Of a long recording those in its middle: what is
/// wrong with a calibration shows in each, and detections and points of all would take gigabytes.
std::vector<int> frames_to_check(const Dataset& dataset, std::vector<Finding>& findings) {
  std::vector<int> frames = frame_ids(dataset);
  std::erase_if(frames, [&](int frame) {
    return std::none_of(
        dataset.frames.begin(), dataset.frames.end(),
        [&](const CameraFrames& camera) { return camera.keypoints.contains(frame); });
  });
  constexpr std::size_t kMost = 5000;
  if (frames.size() > kMost) {
    const auto begin = frames.begin() + static_cast<std::ptrdiff_t>((frames.size() - kMost) / 2);
    findings.push_back(
        {Severity::Note, "keypoints-of-some-frames", "",
         sentence("keypoints are held against the calibration in %zu of %zu frames, "
                  "%d to %d",
                  kMost, frames.size(), *begin, *(begin + static_cast<std::ptrdiff_t>(kMost) - 1)),
         "nothing"});
    frames = std::vector<int>(begin, begin + static_cast<std::ptrdiff_t>(kMost));
  }
  return frames;
}

/// Tells cameras that found nobody: of all of them at once, unless reading the capture did.
void tell_blind_cameras(const Dataset& dataset, const std::vector<std::string>& blind,
                        std::vector<Finding>& findings) {
  constexpr const char* kCode = "keypoints-none";
  if (std::any_of(dataset.findings.begin(), dataset.findings.end(),
                  [&](const Finding& finding) { return finding.code == kCode; })) {
    return;
  }
  if (blind.size() > 1 && blind.size() == dataset.cameras.size()) {
    findings.push_back({Severity::Warning, kCode, dataset.root.string(),
                        "no confident keypoint in any frame of any camera",
                        "detect again, or say by --capture.keypoints what confidences mean"});
    return;
  }
  for (const std::string& camera : blind) {
    findings.push_back({Severity::Warning, kCode, camera, "no confident keypoint in any frame",
                        "does it see the person?"});
  }
}

void check_rows(const Dataset& dataset, const Frames& detections, std::vector<Finding>& findings) {
  std::vector<std::string> blind;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    double outside = 0;
    double found = 0;
    double wrong = 0;
    double largest = 0;
    double extent = 0;
    for (const auto& frame : detections) {
      for (Index k = 0; k < frame[c].rows(); ++k) {
        const double confidence = frame[c](k, 2);
        wrong += confidence < 0 || confidence > 1.2 ? 1 : 0;
        largest = std::max(largest, confidence);
        if (confidence > 0.2) {
          found += 1;
          extent = std::max({extent, frame[c](k, 0), frame[c](k, 1)});
          outside += frame[c](k, 0) < 0 || frame[c](k, 1) < 0 || frame[c](k, 0) > camera.width ||
                             frame[c](k, 1) > camera.height
                         ? 1
                         : 0;
        }
      }
    }
    if (found == 0) {
      blind.push_back(camera.id);
    } else if (extent > 0 && extent < 2) {
      findings.push_back({Severity::Error, "keypoints-scaled", camera.id,
                          "no keypoint is beyond " + short_number(extent, 3) +
                              " px: they are shares of width and height",
                          "read them so", "--capture.keypoints " + camera.id + "=shares"});
    } else if (outside > 0.05 * found) {
      findings.push_back(
          {Severity::Error, "keypoints-outside", camera.id,
           percent(outside / found) + " of the confident points lie outside the image",
           "are they of images of another size?"});
    }
    if (wrong > 0) {
      const bool percent = largest > 10 && largest <= 100;
      findings.push_back({Severity::Warning, "keypoint-confidence", camera.id,
                          sentence("confidences outside 0 to 1, up to %.3g", largest),
                          percent ? "they are percent" : "what do they mean?",
                          percent ? "--capture.keypoints " + camera.id + "=percent" : ""});
    }
  }
  tell_blind_cameras(dataset, blind, findings);
}

std::optional<double> length_of(const SpacePose& pose, const KeypointSchema& schema,
                                const char* from, const char* to) {
  const int a = find_keypoint(schema, from);
  const int b = find_keypoint(schema, to);
  if (a < 0 || b < 0 || pose.points[static_cast<std::size_t>(a)].confidence <= 0 ||
      pose.points[static_cast<std::size_t>(b)].confidence <= 0) {
    return std::nullopt;
  }
  return (pose.points[static_cast<std::size_t>(a)].place -
          pose.points[static_cast<std::size_t>(b)].place)
      .norm();
}

/// Median over the frames; 0: never found.
double usual_length(const Triangulation& found, const KeypointSchema& schema, const char* from,
                    const char* to) {
  std::vector<double> lengths;
  for (const SpacePose& pose : found.frames) {
    if (const auto length = length_of(pose, schema, from, to)) {
      lengths.push_back(*length);
    }
  }
  return median(std::move(lengths));
}

/// The unit in which legs are legs: of millimetres to inches, or no setting.
std::string unit_setting(double leg, const WorldConvention& world) {
  constexpr std::array kUnits = {0.001, 0.01, 0.1, 0.0254, 0.3048, 1.0, 10.0, 100.0, 1000.0};
  for (const double unit : kUnits) {
    const double then = leg * unit / world.metres_per_unit;
    if (then > 0.55 && then < 1.15) {
      return sentence("--capture.metres-per-unit %g", unit);
    }
  }
  // Of none: what makes hip to ankle 0.82 m, as most adults have it.
  return sentence("--capture.metres-per-unit %.3g", 0.82 / leg * world.metres_per_unit);
}

/// Which way the person faces against which side left is on: from toes and heels, or nose and ears.
void check_sides(const Triangulation& found, const KeypointSchema& schema,
                 std::vector<Finding>& findings) {
  const auto place = [&](const SpacePose& pose,
                         const char* name) -> std::optional<Eigen::Vector3d> {
    const int k = find_keypoint(schema, name);
    if (k < 0 || pose.points[static_cast<std::size_t>(k)].confidence <= 0) {
      return std::nullopt;
    }
    return pose.points[static_cast<std::size_t>(k)].place;
  };
  int right_way = 0;
  int wrong_way = 0;
  for (const SpacePose& pose : found.frames) {
    const auto left_hip = place(pose, "left_hip");
    const auto right_hip = place(pose, "right_hip");
    const auto left_shoulder = place(pose, "left_shoulder");
    const auto right_shoulder = place(pose, "right_shoulder");
    const auto nose = place(pose, "nose");
    const auto left_ear = place(pose, "left_ear");
    const auto right_ear = place(pose, "right_ear");
    if (!left_hip || !right_hip || !left_shoulder || !right_shoulder || !nose || !left_ear ||
        !right_ear) {
      continue;
    }
    const Eigen::Vector3d up = *left_shoulder + *right_shoulder - *left_hip - *right_hip;
    const Eigen::Vector3d forward = 2 * *nose - *left_ear - *right_ear;
    const Eigen::Vector3d left = *left_shoulder - *right_shoulder + *left_hip - *right_hip;
    const double side = up.cross(forward).dot(left);
    // Heads turn: only what is clear counts.
    if (std::abs(side) > 0.3 * up.norm() * forward.norm() * left.norm()) {
      ++(side > 0 ? right_way : wrong_way);
    }
  }
  constexpr int kFew = 4;
  if (wrong_way >= kFew && wrong_way > 4 * right_way) {
    findings.push_back({Severity::Error, "keypoint-sides", "",
                        sentence("the person's left is on its right in %d of %d frames", wrong_way,
                                 wrong_way + right_way),
                        "left and right of the keypoints are in each other's place",
                        "--capture.keypoints all=swapped_sides"});
  }
}

/// Of one side: median lengths over the frames, 0: never found.
struct Limb {
  double thigh = 0;
  double shin = 0;
  double arm = 0;
  double fore = 0;
};

Limb limb_of(const Triangulation& found, const KeypointSchema& schema, const std::string& side) {
  const auto length = [&](const char* from, const char* to) {
    return usual_length(found, schema, (side + from).c_str(), (side + to).c_str());
  };
  return {length("_hip", "_knee"), length("_knee", "_ankle"), length("_shoulder", "_elbow"),
          length("_elbow", "_wrist")};
}

bool is_nobodys(const Limb& limb) {
  const auto odd = [](double a, double b, double most) {
    return a > 0 && b > 0 && (a > most * b || b > most * a);
  };
  return odd(limb.thigh, limb.shin, 2) || odd(limb.arm, limb.fore, 2) ||
         (limb.thigh > 0 && limb.shin > 0 && limb.arm > 0 && limb.fore > 0 &&
          odd(limb.thigh + limb.shin, limb.arm + limb.fore, 2.5));
}

void check_person(const Triangulation& found, const KeypointSchema& schema,
                  const WorldConvention& world, std::vector<Finding>& findings) {
  const Limb left = limb_of(found, schema, "left");
  const Limb right = limb_of(found, schema, "right");
  // In few frames chance misplaces a joint, but hardly one on either side.
  constexpr std::size_t kFew = 5;
  const bool both = is_nobodys(left) && is_nobodys(right);
  const bool either = is_nobodys(left) || is_nobodys(right);
  std::vector<double> legs;
  for (const Limb& limb : {left, right}) {
    if (limb.thigh > 0 && limb.shin > 0) {
      legs.push_back(limb.thigh + limb.shin);
    }
  }
  const auto no_leg = [](double leg) { return leg < 0.35 || leg > 1.3; };
  if (found.frames.size() < kFew ? both : either) {
    const Limb& odd = is_nobodys(left) ? left : right;
    findings.push_back({Severity::Error, "keypoint-order", "",
                        sentence("thigh %.3g, shin %.3g, upper arm %.3g, forearm %.3g m are no "
                                 "person's",
                                 odd.thigh, odd.shin, odd.arm, odd.fore),
                        "is the order of the keypoints another? --capture.keypoint-schema says"});
  } else if (!legs.empty() && std::all_of(legs.begin(), legs.end(), no_leg)) {
    findings.push_back({Severity::Error, "person-size", "",
                        sentence("hip to ankle is %.3g m", legs.front()),
                        "which unit is the calibration in?", unit_setting(legs.front(), world)});
  }
}

/// Share of the points that two cameras see and that meet in space.
struct Meeting {
  double wanted = 0;
  double met = 0;
  double unseen = 0;     ///< points that some camera sees, and no second
  double detected = 0;   ///< by the cameras, of what is wanted
  double supported = 0;  ///< of these: agree
};

Meeting meeting_of(const SeenPerson& seen, const Triangulation& found,
                   const TriangulationOptions& options) {
  Meeting meeting;
  for (std::size_t f = 0; f < found.frames.size(); ++f) {
    for (std::size_t k = 0; k < seen.schema->points.size(); ++k) {
      const int views = confident_views(seen.detections[f], k);
      const SpacePoint& point = found.frames[f].points[k];
      meeting.unseen += views > 0 && views < options.min_views ? 1 : 0;
      if (views >= options.min_views) {
        meeting.wanted += 1;
        meeting.detected += views;
        meeting.supported += point.bridged ? 0 : agreeing_views(seen, f, k, point, options.inlier);
        // Two of many views meet by chance; a person is where half of them do.
        meeting.met += !point.bridged && point.confidence > 0 && 2 * point.views >= views ? 1 : 0;
      }
    }
  }
  return meeting;
}

void check_half_pixel(const SeenPerson& seen, const Triangulation& found,
                      std::vector<Finding>& findings) {
  const auto common = common_shift(seen, found);
  // Cameras of one height let the points take up a shift down, so that sideways must do.
  constexpr double kSure = 5;  // deviations
  if (!common || std::abs(common->shift.x()) < kSure * common->deviation.x() ||
      std::abs(common->shift.x()) < 0.3 || std::abs(common->shift.x()) > 0.7) {
    return;
  }
  findings.push_back(
      {Severity::Warning, "half-pixel", "",
       sentence("all keypoints lie %.2f px beside all calibrations (give or take %.2f): one "
                "counts from the first pixel's corner, the other from its centre",
                common->shift.x(), common->deviation.x()),
       "shift the principal points",
       std::string("--capture.pixel-shift all=") + (common->shift.x() > 0 ? "0.5" : "-0.5")});
}

}  // namespace

KeypointCheck check_keypoints(FrameReader& reader, const TriangulationOptions& options) {
  const Dataset& dataset = reader.dataset();
  KeypointCheck check;
  std::vector<Finding>& findings = check.findings;
  const std::vector<int> frames = frames_to_check(dataset, findings);
  if (frames.empty() || !dataset.calibrated || dataset.info.keypoint_schema.empty()) {
    return check;
  }
  const SeenPerson seen = read_person(reader, frames, options, findings);
  check.frame_ids = seen.frame_ids;
  check.detections = seen.detections;
  check_rows(dataset, seen.detections, findings);
  if (dataset.cameras.size() < 2 || seen.detections.empty()) {
    return check;
  }
  Triangulation found = triangulate(seen.cameras, seen.detections, *seen.schema, seen.fps, options);
  std::vector<double> errors = found.camera_error;
  const double usual = median(std::move(errors));
  const Meeting meeting = meeting_of(seen, found, options);
  constexpr double kFew = 20;
  if (meeting.wanted < kFew) {
    return check;
  }
  check.found = found;
  // Half of the cameras can agree although all are misread: a circle is symmetric.
  constexpr double kMaxAgree = 0.8;
  constexpr double kMet = 0.5;
  const double met = meeting.met / meeting.wanted;
  if (usual > kWorstError || meeting.supported < kMaxAgree * meeting.detected) {
    if (const auto explained = explain_all(seen, options)) {
      std::erase_if(findings, [&](const Finding& f) { return f.code == "keypoints-outside"; });
      findings.push_back(*explained);
      return check;
    }
  }
  if (usual > kWorstError || met < kMet) {
    const auto scaled = std::count_if(findings.begin(), findings.end(), [](const Finding& f) {
      return f.code == "keypoints-scaled";
    });
    if (std::cmp_greater_equal(scaled, dataset.cameras.size())) {
      return check;  // which explains it
    }
    findings.push_back({Severity::Error, "calibration-error", "",
                        met > 0 ? percent(met) + " of the keypoints meet in space, with " +
                                      short_number(usual, 3) + " px of error"
                                : "no keypoint of one camera meets those of others in space",
                        "are calibration and images of the same day, size and layout?"});
    return check;
  }
  check.calibration_fits = true;
  const auto distortion = explain_distortion(seen, options);
  if (distortion) {
    findings.push_back(*distortion);
  }
  const std::vector<Finding> off = explain_cameras(seen, found);
  std::erase_if(findings, [&](const Finding& finding) {
    return finding.code == "keypoints-outside" &&
           std::any_of(off.begin(), off.end(), [&](const Finding& other) {
             return other.severity == Severity::Error && other.place == finding.place;
           });
  });
  findings.insert(findings.end(), off.begin(), off.end());
  check_person(found, *seen.schema, dataset.world_convention, findings);
  check_sides(found, *seen.schema, findings);
  if (off.empty() && !distortion) {
    check_half_pixel(seen, found, findings);
  }
  constexpr double kUnseen = 0.3;
  if (meeting.unseen > kUnseen * (meeting.unseen + meeting.wanted)) {
    findings.push_back({Severity::Warning, "coverage-low", "",
                        percent(meeting.unseen / (meeting.unseen + meeting.wanted)) +
                            " of the keypoints are seen by one camera alone",
                        "two cameras must see each part of the person; add some, or turn them"});
  }
  return check;
}

}  // namespace atelier
