#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include "apps/person_measures.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "apps/track_stage.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/personal_body.h"
#include "bodymodel/tracked_motion.h"
#include "capture/truth_archive.h"
#include "core/normals.h"
#include "core/store/result.h"
#include "core/tree.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kDynamicShare = 0.1;  // of the body's vertices

/// The 17 joints that tracking is judged by: those that every person's skeleton has.
struct NamedJoints {
  std::vector<int> all;   // [17], -1 where the skeleton has none
  std::vector<int> legs;  // rows of `all`
};

NamedJoints named_joints(const Skeleton& skeleton) {
  const Humanoid who = recognised_humanoid(skeleton);
  NamedJoints joints;
  joints.all = {who.spine.front(), who.neck.front(), who.neck.back()};
  for (std::size_t side = 0; side < 2; ++side) {
    const Arm& arm = who.arms[side];
    const Leg& leg = who.legs[side];
    joints.all.insert(joints.all.end(), {arm.shoulder, arm.elbow, arm.wrist});
    for (const int joint : {leg.hip, leg.knee, leg.ankle, leg.toe}) {
      if (joint != leg.toe) {
        joints.legs.push_back(static_cast<int>(joints.all.size()));
      }
      joints.all.push_back(joint);
    }
  }
  return joints;
}

/// Errors of joints over frames, metres.
struct JointErrors {
  double all = 0;
  double legs = 0;
  int frames = 0;
  double constant = 0;  // mean length of the offsets that were removed
};

JointErrors joint_errors(const TrackedMotion& tracked, const fs::path& capture,
                         const CaptureTruth& truth) {
  const NamedJoints found = named_joints(tracked.skeleton);
  const NamedJoints real = named_joints(truth.skeleton);
  const bool same = tracked.skeleton.names == truth.skeleton.names;
  const std::size_t count = found.all.size();
  // Gaps in the frames of the true joints' parents, so that a constant one can be told.
  std::vector<std::vector<Eigen::Vector3d>> gaps(count);
  for (std::size_t f = 0; f < tracked.joints.size(); ++f) {
    const TruthFrame frame = read_truth_frame(capture, truth, tracked.motion.frame_ids[f]);
    const bool posed = frame.pose.rotations.rows() == frame.joints.rows();
    const JointFrames frames =
        posed ? forward_kinematics(truth.skeleton, frame.pose) : JointFrames{};
    for (std::size_t j = 0; j < count; ++j) {
      if (found.all[j] < 0 || real.all[j] < 0) {
        continue;
      }
      const Eigen::Vector3d gap =
          (tracked.joints[f].row(found.all[j]) - frame.joints.row(real.all[j])).transpose();
      const int parent = std::max(0, truth.skeleton.parents[static_cast<std::size_t>(real.all[j])]);
      gaps[j].push_back(
          posed ? Eigen::Vector3d(frames.rotations[static_cast<std::size_t>(parent)].transpose() *
                                  gap)
                : gap);
    }
  }
  JointErrors errors;
  errors.frames = static_cast<int>(tracked.joints.size());
  double joints = 0;
  double legs = 0;
  for (std::size_t j = 0; j < count; ++j) {
    if (gaps[j].empty()) {
      continue;
    }
    Eigen::Vector3d constant = Eigen::Vector3d::Zero();
    if (!same) {
      for (const Eigen::Vector3d& gap : gaps[j]) {
        constant += gap / static_cast<double>(gaps[j].size());
      }
    }
    double mean = 0;
    for (const Eigen::Vector3d& gap : gaps[j]) {
      mean += (gap - constant).norm() / static_cast<double>(gaps[j].size());
    }
    errors.all += mean;
    errors.constant += constant.norm();
    joints += 1;
    if (std::find(found.legs.begin(), found.legs.end(), static_cast<int>(j)) != found.legs.end()) {
      errors.legs += mean;
      legs += 1;
    }
  }
  errors.all /= std::max(1.0, joints);
  errors.constant /= std::max(1.0, joints);
  errors.legs /= std::max(1.0, legs);
  return errors;
}

/// The options that a result was made with.
OptionSet options_of_result(const Manifest& manifest) {
  OptionSet set = option_set<TrackStageOptions>();
  for (const ManifestOption& option : manifest.options) {
    std::string text = option.json;
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"') {
      text = text.substr(1, text.size() - 2);
    }
    set_option(set.table, option.name, text, option.source);
  }
  return set;
}

/// Tracks the clothed sequence again with another exclusion.
JointErrors tracked_again(const fs::path& workspace, const fs::path& capture,
                          const CaptureTruth& truth, const CaptureInfo& info,
                          const CaptureSequence& sequence, Exclude exclude) {
  const OptionSet set =
      options_of_result(read_manifest(fs::canonical(workspace / "track" / "current"), "track"));
  TrackStageOptions options = options_of<TrackStageOptions>(set);
  options.fit.exclude = exclude;
  const PersonFiles files{capture, workspace / "reconstruct" / "current",
                          workspace / "reconstruct" / "current"};
  const std::vector<Label> excluded =
      exclude == Exclude::Labels ? labels_of(options.input.excluded) : std::vector<Label>{};
  const PersonalBody person =
      read_personal_body(workspace / "personalize" / "current" / "person.npz");
  return joint_errors(
      track(person.model, person_input(files, info, sequence, options.input, excluded).input,
            options.fit)
          .tracked,
      capture, truth);
}

}  // namespace

std::vector<Measure> measure_personalize(const fs::path& workspace, const fs::path& capture) {
  const fs::path file = workspace / "personalize" / "current" / "person.npz";
  std::vector<Measure> measures;
  if (!fs::exists(file)) {
    return measures;
  }
  const PersonalBody person = read_personal_body(file);
  const CaptureTruth truth = read_capture_truth(capture);
  const NamedJoints found = named_joints(person.model.skeleton);
  const NamedJoints real = named_joints(truth.skeleton);
  const Points found_rest = rest_positions(person.model.skeleton);
  const Points real_rest = rest_positions(truth.skeleton);
  Eigen::RowVector3d shift = Eigen::RowVector3d::Zero();
  double count = 0;
  for (std::size_t j = 0; j < found.all.size(); ++j) {
    if (found.all[j] >= 0 && real.all[j] >= 0) {
      shift += real_rest.row(real.all[j]) - found_rest.row(found.all[j]);
      count += 1;
    }
  }
  shift /= std::max(1.0, count);
  const TriangleTree tree = build_tree(person.model.mesh.vertices, person.model.mesh.faces);
  const Points moved = truth.body.vertices.rowwise() - shift;
  const Eigen::VectorXd areas = vertex_areas(truth.body.vertices, truth.body.faces);
  const std::vector<ClosestPoint> nearest = closest_points(tree, moved);
  double sum = 0;
  for (Index v = 0; v < areas.size(); ++v) {
    sum += areas[v] * std::sqrt(nearest[static_cast<std::size_t>(v)].squared_distance);
  }
  double bones = 0;
  for (std::size_t j = 0; j < found.all.size(); ++j) {
    if (found.all[j] >= 0 && real.all[j] >= 0) {
      bones += (found_rest.row(found.all[j]) + shift - real_rest.row(real.all[j])).norm() / count;
    }
  }
  measures.push_back({"personal.mean_mm", 1e3 * sum / areas.sum(), "mm", 3, Measure::Side::AtMost,
                      "true surface to the person's, at rest, brought together by a shift"});
  measures.push_back({"personal.joints_mm", 1e3 * bones, "mm", 0, Measure::Side::None,
                      "mean distance of joints at rest"});
  return measures;
}

std::vector<Measure> measure_track(const fs::path& workspace, const fs::path& capture) {
  const fs::path result = workspace / "track" / "current";
  std::vector<Measure> measures;
  if (!fs::exists(result)) {
    return measures;
  }
  const CaptureTruth truth = read_capture_truth(capture);
  const CaptureInfo info = read_capture_info(capture);
  for (const CaptureSequence& sequence : info.sequences) {
    const fs::path file = result / "tracked" / (sequence.name + ".h5");
    if (!fs::exists(file) || sequence.kind == "minimal") {
      continue;
    }
    const TrackedMotion tracked = read_tracked_motion(file);
    const JointErrors errors = joint_errors(tracked, capture, truth);
    const std::string over = "mean over " + std::to_string(errors.frames) + " frames";
    measures.push_back(
        {"track.mean_mm", 1e3 * errors.all, "mm", 6, Measure::Side::AtMost, over + ", 17 joints"});
    measures.push_back({"track.legs_mm", 1e3 * errors.legs, "mm", 10, Measure::Side::AtMost,
                        "hips, knees, ankles"});
    if (errors.constant > 0) {
      measures.push_back({"track.constant_mm", 1e3 * errors.constant, "mm", 0, Measure::Side::None,
                          "mean of the joints' constant offsets, which are removed"});
    }
    measures.push_back({"track.deviation_mm", 1e3 * tracked.deviations.mean(), "mm", 0,
                        Measure::Side::None, "uncertainty that it states"});
    const Index vertices = vertex_count(
        read_personal_body(workspace / "personalize" / "current" / "person.npz").model);
    // A fold that swings at a hem is no dynamic clothing.
    if (static_cast<double>(tracked.region.size()) >
        kDynamicShare * static_cast<double>(vertices)) {
      const double none =
          tracked_again(workspace, capture, truth, info, sequence, Exclude::None).legs;
      const double labels =
          tracked_again(workspace, capture, truth, info, sequence, Exclude::Labels).legs;
      measures.push_back({"track.legs_none_mm", 1e3 * none, "mm", 0, Measure::Side::None,
                          "the same with exclude = none"});
      measures.push_back({"track.legs_ratio", errors.legs / none, "", 0.5, Measure::Side::AtMost,
                          "legs with exclusion over without"});
      measures.push_back({"track.auto_ratio", errors.legs / labels, "", 1.2, Measure::Side::AtMost,
                          "legs over those with exclude = labels"});
    }
    break;  // the first clothed sequence is judged
  }
  return measures;
}

}  // namespace atelier

#endif
