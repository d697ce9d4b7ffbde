#include "bodymodel/tracking/track.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bodymodel/rotation.h"
#include "bodymodel/tracking/detector_bias.h"
#include "bodymodel/tracking/keypoint_unit.h"
#include "bodymodel/tracking/scan_agreement.h"
#include "bodymodel/tracking/start_pose.h"
#include "core/error.h"
#include "core/listed_frames.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kBridgePrior = 0.02;  // pull to rest where neighbours know better
constexpr double kWideReach = 0.25;    // m, of first matches where no keypoints say where it is
constexpr int kTrackingIterations = 30;
constexpr Index kModelSamples = 4;  // points of a scan for each vertex of the body, in a round
constexpr int kSkinRounds = 2;      // before it is asked what clothing swings

struct Range {
  std::size_t begin, end;            // frames that are solved together
  std::size_t keep_begin, keep_end;  // of which these are kept
};

std::vector<Range> windows_of(std::size_t frames, const TrackOptions& options) {
  const auto size = static_cast<std::size_t>(options.window);
  const std::size_t step = size - static_cast<std::size_t>(options.overlap);
  std::vector<Range> ranges;
  for (std::size_t begin = 0;; begin += step) {
    const std::size_t end = std::min(frames, begin + size);
    ranges.push_back({begin, end, begin, end});
    if (end == frames) {
      break;
    }
  }
  for (std::size_t w = 1; w < ranges.size(); ++w) {  // each keeps what it sees from both sides
    const std::size_t middle = (ranges[w].begin + ranges[w - 1].end + 1) / 2;
    ranges[w - 1].keep_end = middle;
    ranges[w].keep_begin = middle;
  }
  return ranges;
}

double rms_of(const std::vector<double>& distances) {
  double sum = 0;
  for (const double one : distances) {
    sum += one * one;
  }
  return distances.empty() ? 0 : std::sqrt(sum / static_cast<double>(distances.size()));
}

class Sequencer {
 public:
  Sequencer(const BodyModel& model, const TrackInput& input, const TrackOptions& options)
      : input_(input),
        options_(options),
        person_(fitted_person(model, input.keypoint_names, options.fingers)),
        rest_(rest_surface(person_)),
        areas_(vertex_areas(rest_.vertices, model.mesh.faces)),
        ranges_(windows_of(input.frames.size(), options)) {
    for (const int id : input.frame_ids) {
      times_.push_back(id / input.fps);
    }
  }

  Tracking run() {
    begin();
    solve_keypoints();
    const bool scans = std::any_of(scans_.begin(), scans_.end(),
                                   [](const ScanPoints* scan) { return scan != nullptr; });
    if (scans && options_.rounds > 0) {
      prepare_lookups();
      std::vector<char> region = input_.region;
      int done = 0;
      if (options_.exclude == Exclude::Auto) {
        skin_only_ = any_skin();
        solve({}, kSkinRounds, options_.iterations);
        skin_only_ = false;
        region = found_region();
        done = kSkinRounds;
        const int half = std::max(1, (options_.rounds - done) / 2);
        solve(region, half, options_.iterations);
        region = found_region();
        done += half;
      } else if (options_.exclude != Exclude::Region) {
        region.clear();
      }
      solve(region, std::max(1, options_.rounds - done), options_.iterations);
      region_ = region;
    }
    return finished();
  }

 private:
  void begin() {
    std::vector<FrameTargets> targets;
    for (const TrackFrame& frame : input_.frames) {
      FrameTargets one;
      one.keypoints = frame.keypoints;
      one.deviations = frame.deviations;
      targets.push_back(std::move(one));
    }
    const OtherUnits others = without_other_units(targets);
    starts_ = start_poses(person_, targets, times_, options_.weights);
    std::vector<int> missing;
    std::vector<int> mirrored;
    std::vector<int> sized;
    std::string size_problem;  // of the first of them
    bool unlabelled = false;
    for (std::size_t f = 0; f < starts_.size(); ++f) {
      x_.push_back(starts_[f].x);
      if (!starts_[f].trusted) {
        starts_[f].targets.prior = kBridgePrior;
        if (!others.is_one(f)) {  // which has a finding of its own
          missing.push_back(input_.frame_ids[f]);
        }
      }
      if (starts_[f].reading != SideReading::AsNamed) {
        mirrored.push_back(input_.frame_ids[f]);
      }
      const ScanPoints& scan = input_.frames[f].scan;
      scans_.push_back(nullptr);
      if (scan.points.rows() == 0) {
        continue;
      }
      const std::string problem = scan_size_problem(scan, person_.shaped.vertices);
      if (!problem.empty()) {
        size_problem = sized.empty() ? problem : size_problem;
        sized.push_back(input_.frame_ids[f]);
        continue;
      }
      unlabelled = unlabelled || std::none_of(scan.parts.begin(), scan.parts.end(),
                                              [](ScanPart p) { return p == ScanPart::Skin; });
      scans_.back() = &scan;
    }
    if (!others.frames.empty()) {
      findings_.push_back(keypoint_unit(others, input_.frame_ids,
                                        "poses come from the frames around and from scans"));
    }
    if (!missing.empty()) {
      findings_.push_back({Severity::Warning, "keypoints-missing",
                           "frames " + listed_frames(missing),
                           "too few keypoints, or they contradict each other",
                           "their poses come from the frames around and from scans"});
    }
    if (!mirrored.empty()) {
      findings_.push_back({Severity::Note, "left-right", "frames " + listed_frames(mirrored),
                           "keypoints fit better with left and right exchanged",
                           "they were exchanged"});
    }
    if (!sized.empty()) {
      findings_.push_back({Severity::Warning, "scan-unit", "frames " + listed_frames(sized),
                           size_problem, "left out; look whether they are in millimetres"});
    }
    if (unlabelled) {
      findings_.push_back({Severity::Note, "labels-absent", "scans", "no point is labelled as skin",
                           "all is taken as clothing, with the body inside"});
    }
  }

  bool shows(std::size_t f, ScanPart part) const {
    return scans_[f] != nullptr && std::find(scans_[f]->parts.begin(), scans_[f]->parts.end(),
                                             part) != scans_[f]->parts.end();
  }

  bool any_skin() const {
    for (std::size_t f = 0; f < scans_.size(); ++f) {
      if (shows(f, ScanPart::Skin)) {
        return true;
      }
    }
    return false;
  }

  void prepare_lookups() {
    lookups_.resize(scans_.size());
    parallel_for(static_cast<Index>(scans_.size()), 1, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        const auto i = static_cast<std::size_t>(f);
        if (options_.model_to_scan > 0 && shows(i, ScanPart::Skin)) {
          lookups_[i] = scan_lookup(*scans_[i]);
        }
      }
    });
  }

  /// All frames are matched, then windows solved, `rounds` times. Frames that two windows share are
  /// matched once, at the pose of the window that keeps them.
  void solve(const std::vector<char>& region, int rounds, int iterations) {
    std::vector<FrameTargets> targets;
    for (const StartPose& start : starts_) {
      targets.push_back(start.targets);
    }
    for (int round = 0; round < rounds; ++round) {
      parallel_for(static_cast<Index>(targets.size()), 1, [&](Index begin, Index end) {
        for (Index f = begin; f < end; ++f) {
          const auto i = static_cast<std::size_t>(f);
          if (scans_[i] != nullptr) {
            const BodySurface surface = posed_surface(person_, rest_, x_[i]);
            targets[i].matches =
                both_ways(i, surface, matches_of(i, surface, region, round), round);
          }
        }
      });
      solve_windows(person_, targets, iterations);
    }
  }

  /// Keypoints alone. Fingers that none of them rides on stay where they are, and are left out.
  void solve_keypoints() {
    std::vector<FrameTargets> targets;
    for (const StartPose& start : starts_) {
      targets.push_back(start.targets);
    }
    FittedPerson fewer;
    if (options_.fingers) {
      fewer = fitted_person(*person_.model, input_.keypoint_names);
    }
    const std::vector<int>& carriers = person_.places.riding.joints;
    const bool whole =
        !options_.fingers || std::any_of(carriers.begin(), carriers.end(), [&](int joint) {
          return joint >= 0 && person_.slots[static_cast<std::size_t>(joint)] >= 0 &&
                 fewer.slots[static_cast<std::size_t>(joint)] < 0;
        });
    if (whole) {
      solve_windows(person_, targets, kTrackingIterations);
      return;
    }
    const auto change = [&](const FittedPerson& from, const FittedPerson& to) {
      for (Eigen::VectorXd& x : x_) {
        x = pose_variables(to, pose_of_variables(from, x));
      }
    };
    change(person_, fewer);
    solve_windows(fewer, targets, kTrackingIterations);
    change(fewer, person_);
  }

  void solve_windows(const FittedPerson& person, const std::vector<FrameTargets>& targets,
                     int iterations) {
    std::vector<std::vector<Eigen::VectorXd>> found(ranges_.size());
    parallel_for(static_cast<Index>(ranges_.size()), 1, [&](Index first, Index last) {
      for (Index w = first; w < last; ++w) {
        const auto i = static_cast<std::size_t>(w);
        TrackWindow window;
        for (std::size_t f = ranges_[i].begin; f < ranges_[i].end; ++f) {
          window.targets.push_back(&targets[f]);
          window.times.push_back(times_[f]);
          window.start.push_back(x_[f]);
          Eigen::VectorXd& x = window.start.back();  // no rotation vector near its singularity
          x.segment<3>(3) = rotation_vector(rotation_matrix(x.segment<3>(3)));
        }
        found[i] = solve_window(person, window, options_.weights, options_.motion, iterations).x;
      }
    });
    for (std::size_t w = 0; w < ranges_.size(); ++w) {
      for (std::size_t f = ranges_[w].keep_begin; f < ranges_[w].keep_end; ++f) {
        x_[f] = found[w][f - ranges_[w].begin];
      }
    }
  }

  std::vector<SurfaceMatch> matches_of(std::size_t f, const BodySurface& surface,
                                       const std::vector<char>& region, int round) const {
    MatchOptions matching;
    if (!starts_[f].trusted && round == 0) {
      matching.reach = kWideReach;
    }
    ScanPoints points = sampled(*scans_[f], options_.samples, round);
    if (skin_only_) {
      std::replace(points.parts.begin(), points.parts.end(), ScanPart::Cloth, ScanPart::Ignored);
    }
    return match_scan(person_, surface, points, region, matching);
  }

  /// `matches` of a frame's scan, and what the body's vertices have of its skin.
  std::vector<SurfaceMatch> both_ways(std::size_t f, const BodySurface& surface,
                                      std::vector<SurfaceMatch> matches, int round) const {
    if (matches.empty() || lookups_.empty() || lookups_[f].tree.nodes.empty()) {
      return matches;
    }
    std::vector<SurfaceMatch> back = match_model(surface, areas_, *scans_[f], lookups_[f],
                                                 {options_.samples / kModelSamples, round});
    for (SurfaceMatch& match : matches) {
      match.weight *= match.cloth ? 1 : 1 - options_.model_to_scan;
    }
    for (SurfaceMatch& match : back) {
      match.weight *= options_.model_to_scan;
    }
    matches.insert(matches.end(), back.begin(), back.end());
    return matches;
  }

  std::vector<char> found_region() const {
    std::vector<ClothGaps> gaps(scans_.size());
    parallel_for(static_cast<Index>(scans_.size()), 1, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        const auto i = static_cast<std::size_t>(f);
        if (shows(i, ScanPart::Cloth)) {
          gaps[i] = cloth_gaps(person_, posed_surface(person_, rest_, x_[i]),
                               sampled(*scans_[i], options_.samples));
        }
      }
    });
    std::erase_if(gaps, [](const ClothGaps& one) { return one.sum.size() == 0; });
    return dynamic_region(person_, gaps, options_.dynamic);
  }

  /// [V] 1 where what of the scan is nearest is left out, in most frames: for the report alone.
  std::vector<char> under_left_out() const {
    Eigen::VectorXd votes = Eigen::VectorXd::Zero(rest_.vertices.rows());
    for (std::size_t f = 0; f < scans_.size(); ++f) {
      if (scans_[f] == nullptr) {
        continue;
      }
      const std::vector<ClosestPoint> nearest = closest_points(
          build_point_tree(scans_[f]->points), posed_surface(person_, rest_, x_[f]).vertices);
      for (Index v = 0; v < votes.size(); ++v) {
        const int point = nearest[static_cast<std::size_t>(v)].face;
        votes[v] += scans_[f]->parts[static_cast<std::size_t>(point)] == ScanPart::LeftOut ? 1 : -1;
      }
    }
    std::vector<char> region;
    for (const double vote : votes) {
      region.push_back(vote > 0 ? 1 : 0);
    }
    return region;
  }

  Tracking finished() {
    const std::size_t count = x_.size();
    const auto rows = static_cast<Index>(count);
    const auto joints = static_cast<Index>(person_.shaped.skeleton.names.size());
    Tracking result;
    TrackedMotion& tracked = result.tracked;
    tracked.skeleton = person_.shaped.skeleton;
    tracked.motion.fps = input_.fps;
    tracked.motion.frame_ids = input_.frame_ids;
    tracked.trusted.assign(count, 1);
    tracked.deviations = RowMatrix::Zero(rows, joints);
    tracked.keypoint_rms = Eigen::VectorXd::Zero(rows);
    tracked.scan_rms = Eigen::VectorXd::Zero(rows);
    tracked.scan_share = Eigen::VectorXd::Zero(rows);
    std::vector<FrameTargets> targets(count);
    std::vector<double> off(count, 0);
    std::vector<double> unmet(count, 0);
    std::vector<ScanAgreement> agreements(count);  // of frames without keypoints
    parallel_for(rows, 1, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        const auto i = static_cast<std::size_t>(f);
        targets[i] = starts_[i].targets;
        if (scans_[i] != nullptr) {
          const BodySurface surface = posed_surface(person_, rest_, x_[i]);
          std::vector<SurfaceMatch> seen = matches_of(i, surface, region_, 0);
          const MatchError error = match_error(surface.vertices, seen);
          targets[i].matches = both_ways(i, surface, std::move(seen), 0);
          tracked.scan_rms[f] = error.rms;
          tracked.scan_share[f] = error.share;
          off[i] = foreign_share(person_, surface, *scans_[i]);
          if (!starts_[i].trusted) {
            agreements[i] = scan_agreement(person_, surface, areas_, *scans_[i], region_);
          }
        }
        tracked.keypoint_rms[f] = rms_of(keypoint_distances(i, x_[i]));
        unmet[i] = unmet_keypoints(i);
        const bool held = starts_[i].trusted || agreements[i].holds;
        tracked.trusted[i] = held && unmet[i] < kUntrustedError ? 1 : 0;
      }
    });
    std::vector<int> untrusted;
    std::vector<int> missed;
    std::vector<int> far;
    for (std::size_t f = 0; f < count; ++f) {
      const Pose pose = pose_of_variables(person_, x_[f]);
      tracked.joints.push_back(forward_kinematics(person_.shaped.skeleton, pose).positions);
      tracked.motion.poses.push_back(pose);
      if (tracked.trusted[f] == 0) {
        (unmet[f] < kUntrustedError ? untrusted : missed).push_back(input_.frame_ids[f]);
      }
      if (off[f] > kFarShare) {
        far.push_back(input_.frame_ids[f]);
      }
    }
    if (!far.empty()) {
      const double most = *std::max_element(off.begin(), off.end());
      findings_.push_back({Severity::Warning, "scan-far", "frames " + listed_frames(far),
                           "up to " + percent(most) + " of the scan is no part of the person",
                           "it does not count; look for a second person or wrong calibration"});
    }
    if (!untrusted.empty()) {
      findings_.push_back({Severity::Warning, "frame-untrusted",
                           "frames " + listed_frames(untrusted),
                           "neither keypoints nor a scan say where the person is",
                           "bridged from the frames around; do not measure on them"});
    }
    if (!missed.empty()) {
      char rate[32];
      std::snprintf(rate, sizeof(rate), "%g", input_.fps);
      const double most = *std::max_element(unmet.begin(), unmet.end());
      findings_.push_back(
          {Severity::Warning, "keypoints-unmet", "frames " + listed_frames(missed),
           "poses lie up to " + std::to_string(saturating_cast<int>(std::round(1e3 * most))) +
               " mm (rms) from keypoints that a pose of each frame alone would meet",
           "not trusted; check that " + std::string(rate) +
               " frames a second is right (--capture.fps), and that the person of "
               "'personalize' is this one; a larger --motion.acceleration suits "
               "fast motion"});
    }
    deviations(targets, tracked.deviations);
    const Eigen::ArrayXd standing = detector_bias(person_, targets, x_).array();
    for (std::size_t f = 0; f < count; ++f) {
      if (scans_[f] == nullptr) {
        const auto row = static_cast<Index>(f);
        tracked.deviations.row(row) =
            (tracked.deviations.row(row).array().square() + standing.transpose().square()).sqrt();
      }
    }
    for (std::size_t f = 0; f < count; ++f) {  // the spread of a wrong minimum says nothing
      const double off_by = unmet[f] >= kUntrustedError ? unmet[f]
                            : agreements[f].holds       ? 0
                                                        : agreements[f].apart;
      const auto row = static_cast<Index>(f);
      tracked.deviations.row(row) = tracked.deviations.row(row).cwiseMax(off_by);
    }
    const std::vector<char> region =
        options_.exclude == Exclude::Labels ? under_left_out() : region_;
    for (std::size_t v = 0; v < region.size(); ++v) {
      if (region[v] != 0) {
        tracked.region.push_back(static_cast<int>(v));
      }
    }
    check_tracked_motion(tracked);
    result.findings = findings_;
    return result;
  }

  /// [seen] metres between the keypoints of a frame and where a pose has them.
  std::vector<double> keypoint_distances(std::size_t f, const Eigen::VectorXd& x) const {
    const FrameTargets& targets = starts_[f].targets;
    const Points at = marker_positions(
        seen_only(), forward_kinematics(person_.shaped.skeleton, pose_of_variables(person_, x)));
    std::vector<double> distances;
    for (Index k = 0; k < targets.keypoints.rows(); ++k) {
      if (targets.deviations[k] > 0 &&
          person_.places.riding.joints[static_cast<std::size_t>(k)] >= 0) {
        distances.push_back((at.row(k) - targets.keypoints.row(k)).norm());
      }
    }
    return distances;
  }

  /// How far, m rms, a frame's pose is from the keypoints that its start met. Those that the start
  /// did not meet are the detector's mistakes, and say nothing against the pose.
  double unmet_keypoints(std::size_t f) const {
    const std::vector<double> before = keypoint_distances(f, starts_[f].x);
    std::vector<double> now = keypoint_distances(f, x_[f]);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < now.size(); ++k) {
      if (before[k] < kUntrustedError) {
        now[kept++] = now[k];
      }
    }
    now.resize(kept);
    return rms_of(now);
  }

  /// Places of keypoints that the body does not know ride on the root, and are not asked for.
  RidingMarkers seen_only() const {
    RidingMarkers riding = person_.places.riding;
    std::replace(riding.joints.begin(), riding.joints.end(), -1, 0);
    return riding;
  }

  void deviations(const std::vector<FrameTargets>& targets, RowMatrix& result) const {
    parallel_for(static_cast<Index>(ranges_.size()), 1, [&](Index first, Index last) {
      for (Index w = first; w < last; ++w) {
        const Range& range = ranges_[static_cast<std::size_t>(w)];
        TrackWindow window;
        for (std::size_t f = range.begin; f < range.end; ++f) {
          window.targets.push_back(&targets[f]);
          window.times.push_back(times_[f]);
          window.start.push_back(x_[f]);
        }
        const RowMatrix spread =
            joint_deviations(person_, window, window.start, options_.weights, options_.motion);
        for (std::size_t f = range.keep_begin; f < range.keep_end; ++f) {
          for (std::size_t j = 0; j < person_.slots.size(); ++j) {
            // Joints that were not sought err as the nearest one above that was.
            int joint = static_cast<int>(j);
            while (person_.slots[static_cast<std::size_t>(joint)] < 0) {
              joint = person_.shaped.skeleton.parents[static_cast<std::size_t>(joint)];
            }
            result(static_cast<Index>(f), static_cast<Index>(j)) =
                spread(static_cast<Index>(f - range.begin),
                       person_.slots[static_cast<std::size_t>(joint)]);
          }
        }
      }
    });
  }

  const TrackInput& input_;
  const TrackOptions& options_;
  FittedPerson person_;
  BodySurface rest_;
  Eigen::VectorXd areas_;  // [V] m2
  std::vector<Range> ranges_;
  std::vector<double> times_;
  std::vector<StartPose> starts_;
  std::vector<Eigen::VectorXd> x_;
  std::vector<const ScanPoints*> scans_;
  std::vector<ScanLookup> lookups_;  // of frames whose scan shows skin
  std::vector<char> region_;
  bool skin_only_ = false;
  std::vector<Finding> findings_;
};

}  // namespace

OptionTable describe(TrackOptions& options) {
  OptionTable table;
  table.add("exclude", options.exclude,
            {{"auto", Exclude::Auto},
             {"labels", Exclude::Labels},
             {"region", Exclude::Region},
             {"none", Exclude::None}},
            "Clothing left out of the surface term: auto (what swings), labels (by label), region "
            "(over a region of the body), none");
  table.add("weights", describe(options.weights));
  table.add("motion", describe(options.motion));
  table.add("dynamic", describe(options.dynamic));
  table.add("samples", options.samples, 0, 1e7, "",
            "Number of points of each scan in an iteration; 0: all");
  table.add("model_to_scan", options.model_to_scan, 0, 1, "",
            "Fraction of the skin term that is measured from the body to the scan; 0: only from "
            "the scan to the body");
  table.add("rounds", options.rounds, 0, 100, "", "Number of ICP rounds; 0: keypoints alone");
  table.add("window", options.window, 3, 1000, "",
            "Number of frames solved jointly; more takes more memory");
  table.add("overlap", options.overlap, 0, 500, "",
            "Number of frames shared by neighbouring windows, at most half a window");
  table.add("iterations", options.iterations, 1, 1000, "", "Solver iterations in an ICP round");
  table.add("fingers", options.fingers,
            "Estimation of finger poses; requires keypoints of hands or close-ups");
  return table;
}

Tracking track(const BodyModel& model, const TrackInput& input, const TrackOptions& options) {
  ATELIER_CHECK(
      input.frames.size() == input.frame_ids.size() && !input.frames.empty() && input.fps > 0,
      "frames with numbers and a rate");
  ATELIER_CHECK(options.window >= 3 && 2 * options.overlap <= options.window,
                "windows of three frames and more, which share at most half");
  ATELIER_CHECK(
      input.region.empty() || static_cast<Index>(input.region.size()) == vertex_count(model),
      "a region of the body's vertices");
  for (std::size_t f = 0; f < input.frames.size(); ++f) {
    ATELIER_CHECK(f == 0 || input.frame_ids[f] > input.frame_ids[f - 1], "frame ids increase");
    const TrackFrame& frame = input.frames[f];
    ATELIER_CHECK(frame.keypoints.rows() == frame.deviations.size() &&
                      (frame.keypoints.rows() == 0 ||
                       frame.keypoints.rows() == static_cast<Index>(input.keypoint_names.size())),
                  "keypoints by name");
  }
  return Sequencer(model, input, options).run();
}

}  // namespace atelier
