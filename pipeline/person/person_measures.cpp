#include "pipeline/person/person_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "capture/ground_truth_scan.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/json.h"
#include "core/normals.h"
#include "core/store/result.h"
#include "core/tree.h"
#include "pipeline/person/personalize_stage.h"
#include "pipeline/person/track_stage.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kDynamicShare = 0.1;  // of the body's vertices, that makes clothing dynamic

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

/// World from rest of each joint's parent, for a person of whom joints alone are known: the trunk's
/// by hips and neck, and turned on by the least that brings the bone to where it is. Along its bone
/// a limb's turn is not known. Our choice.
std::vector<Eigen::Matrix3d> bone_rotations(const Skeleton& skeleton, const Points& joints) {
  const Humanoid who = recognised_humanoid(skeleton);
  const auto trunk = [&](const Points& at) -> Eigen::Matrix3d {
    const Eigen::Vector3d left =
        (at.row(who.legs[0].hip) - at.row(who.legs[1].hip)).transpose().normalized();
    const Eigen::Vector3d up = (at.row(who.arms[0].shoulder) + at.row(who.arms[1].shoulder) -
                                at.row(who.legs[0].hip) - at.row(who.legs[1].hip))
                                   .transpose()
                                   .normalized();
    Eigen::Matrix3d axes;
    axes.col(0) = left;
    axes.col(2) = left.cross(up).normalized();
    axes.col(1) = axes.col(2).cross(left);
    return axes;
  };
  const Eigen::Matrix3d turn = trunk(joints) * trunk(rest_positions(skeleton)).transpose();
  std::vector<Eigen::Matrix3d> rotations(skeleton.names.size(), turn);
  for (std::size_t j = 0; j < rotations.size(); ++j) {
    if (skeleton.parents[j] < 0) {
      continue;
    }
    const auto row = static_cast<Index>(j);
    const Eigen::Vector3d before = turn * skeleton.offsets.row(row).transpose();
    const Eigen::Vector3d now = (joints.row(row) - joints.row(skeleton.parents[j])).transpose();
    if (before.norm() > 1e-6 && now.norm() > 1e-6) {
      rotations[j] = Eigen::Quaterniond::FromTwoVectors(before, now).toRotationMatrix() * turn;
    }
  }
  return rotations;
}

JointErrors joint_errors(const TrackedMotion& tracked, const fs::path& capture,
                         const GroundTruth& truth) {
  const NamedJoints found = named_joints(tracked.skeleton);
  const NamedJoints real = named_joints(truth.skeleton);
  const bool same = tracked.skeleton.names == truth.skeleton.names;
  const std::size_t count = found.all.size();
  // Gaps in the frames of the true joints' parents, so that a constant one can be told.
  std::vector<std::vector<Eigen::Vector3d>> gaps(count);
  for (std::size_t f = 0; f < tracked.joints.size(); ++f) {
    const GroundTruthFrame frame =
        read_ground_truth_frame(capture, truth, tracked.motion.frame_ids[f]);
    const bool posed = frame.pose.rotations.rows() == frame.joints.rows();
    const JointFrames frames =
        posed ? forward_kinematics(truth.skeleton, frame.pose) : JointFrames{};
    const std::vector<Eigen::Matrix3d> bones =
        posed ? std::vector<Eigen::Matrix3d>{} : bone_rotations(truth.skeleton, frame.joints);
    for (std::size_t j = 0; j < count; ++j) {
      if (found.all[j] < 0 || real.all[j] < 0) {
        continue;
      }
      const Eigen::Vector3d gap =
          (tracked.joints[f].row(found.all[j]) - frame.joints.row(real.all[j])).transpose();
      const auto joint = static_cast<std::size_t>(real.all[j]);
      const auto parent = static_cast<std::size_t>(std::max(0, truth.skeleton.parents[joint]));
      const Eigen::Matrix3d& turn = posed ? frames.rotations[parent] : bones[joint];
      gaps[j].push_back(turn.transpose() * gap);
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

/// The options that a result was made with. Throws DataError where one is none of the stage.
template <class Options>
Options options_of_result(const Manifest& manifest) {
  OptionSet set = option_set<Options>();
  for (const ManifestOption& option : manifest.options) {
    const nlohmann::json value = parse_json(option.json, "manifest.json");
    const std::string text = value.is_string() ? value.get<std::string>() : option.json;
    const std::string problem = set_option(set.table, option.name, text, option.source);
    if (!problem.empty()) {
      throw DataError("manifest.json", option.name, option.json.substr(0, 80), problem);
    }
  }
  return options_of<Options>(set);
}

Manifest current_manifest(const fs::path& workspace, const std::string& stage) {
  return read_manifest(fs::canonical(workspace / stage / "current"), stage);
}

/// A clothed sequence with what it can be tracked from once more.
struct Retrack {
  const BodyModel& person;
  PersonFiles files;
  const GroundTruth& truth;
  const CaptureInfo& info;
  const CaptureSequence& sequence;
  TrackStageOptions options;  // as the result has them

  /// Joints' errors with another exclusion, all else as it was.
  JointErrors operator()(Exclude exclude) const {
    TrackOptions fit = options.fit;
    fit.exclude = exclude;
    TrackInput input = person_input(files, info, sequence, options.input).input;
    if (exclude == Exclude::Labels) {
      ignore_true_garments(input, labels_of(options.input.excluded));
    }
    return joint_errors(track(person, input, fit).tracked, files.capture, truth);
  }

 private:
  /// Points whose nearest true surface is a garment to leave out say nothing: the reference that
  /// no detector and no segmentation can beat.
  void ignore_true_garments(TrackInput& input, const std::vector<Label>& excluded) const {
    for (std::size_t f = 0; f < input.frames.size(); ++f) {
      ScanPoints& scan = input.frames[f].scan;
      const Mesh real = ground_truth_scan(
          truth, read_ground_truth_frame(files.capture, truth, input.frame_ids[f]));
      if (scan.points.rows() == 0 || real.faces.rows() == 0) {
        continue;
      }
      const TriangleTree tree = build_tree(real.vertices, real.faces);
      const std::vector<ClosestPoint> nearest = closest_points(tree, scan.points);
      for (std::size_t i = 0; i < nearest.size(); ++i) {
        const int corner = real.faces(nearest[i].face, 0);
        const auto label = static_cast<Label>(real.labels[static_cast<std::size_t>(corner)]);
        if (std::find(excluded.begin(), excluded.end(), label) != excluded.end()) {
          scan.parts[i] = ScanPart::LeftOut;
        }
      }
    }
  }
};

/// Share of the true body over which the true clothing is dynamic, by what `--exclude auto` asks of
/// scans (dynamic_region): so that a detector that finds nothing does not thereby go unjudged.
double true_dynamic_share(const fs::path& capture, const GroundTruth& truth,
                          const CaptureSequence& sequence, const DynamicOptions& options) {
  BodyModel body;
  body.mesh = truth.body;
  FittedPerson person;
  person.model = &body;
  person.shaped.vertices = truth.body.vertices;
  std::vector<ClothGaps> gaps;
  for (const int id : sequence.frame_ids) {
    const GroundTruthFrame frame = read_ground_truth_frame(capture, truth, id);
    const BodySurface surface{frame.body, vertex_normals(frame.body, truth.body.faces),
                              build_tree(frame.body, truth.body.faces)};
    ClothGaps all{Eigen::VectorXd::Zero(frame.body.rows()),
                  Eigen::VectorXd::Zero(frame.body.rows())};
    for (std::size_t g = 0; g < frame.garments.size(); ++g) {
      if (frame.garments[g].rows() == 0) {
        continue;
      }
      Mesh garment;
      garment.vertices = frame.garments[g];
      garment.faces = truth.garments[g].garment.mesh.faces;
      const ClothGaps one = cloth_gaps(person, surface, scan_points(garment));
      all.sum += one.sum;
      all.count += one.count;
    }
    gaps.push_back(std::move(all));
  }
  const std::vector<char> region = dynamic_region(person, gaps, options);
  return region.empty() ? 0
                        : static_cast<double>(std::count(region.begin(), region.end(), 1)) /
                              static_cast<double>(region.size());
}

/// Whether a true garment has one of the labels.
bool wears(const GroundTruth& truth, const std::vector<Label>& labels) {
  return std::any_of(truth.garments.begin(), truth.garments.end(),
                     [&](const GroundTruthGarment& one) {
                       return std::find(labels.begin(), labels.end(), one.label) != labels.end();
                     });
}

}  // namespace

std::string track_problem(const fs::path& workspace, const fs::path& capture) {
  if (!fs::exists(workspace / "track" / "current") ||
      !read_ground_truth(capture).skeleton.names.empty()) {
    return "";
  }
  return "the ground truth has no joints: its bodies come from a sequence without joints that "
         "match "
         "a person";
}

std::string personalize_problem(const fs::path& workspace, const fs::path& capture) {
  const fs::path file = workspace / "personalize" / "current" / "person.npz";
  if (fs::exists(file) && read_ground_truth(capture).skin_weights.rows() == 0) {
    return "the ground truth's body comes from a sequence and is not at rest; track and body are "
           "measured in the frames";
  }
  if (!fs::exists(file) ||
      read_personal_body(file).model.skeleton.names == read_ground_truth(capture).skeleton.names) {
    return "";
  }
  return "the person's body model has another rest pose than the ground truth's, so that their "
         "surfaces at rest are not comparable; track and body are measured in the frames";
}

std::vector<Measure> measure_personalize(const fs::path& workspace, const fs::path& capture) {
  const fs::path file = workspace / "personalize" / "current" / "person.npz";
  std::vector<Measure> measures;
  if (!fs::exists(file)) {
    return measures;
  }
  const PersonalBody person = read_personal_body(file);
  const GroundTruth truth = read_ground_truth(capture);
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
  const bool from_truth =
      options_of_result<PersonalizeStageOptions>(current_manifest(workspace, "personalize"))
          .input.scans == ScanSource::Truth;
  measures.push_back(
      {"personal.mean_mm", 1e3 * sum / areas.sum(), "mm", from_truth ? 2.0 : 3.0,
       Measure::Side::AtMost,
       std::string("ground-truth surface to the person's at rest, aligned by a translation") +
           (from_truth ? "; from ground-truth scans" : "")});
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
  const GroundTruth truth = read_ground_truth(capture);
  const auto options = options_of_result<TrackStageOptions>(current_manifest(workspace, "track"));
  const fs::path reconstructed = workspace / "reconstruct" / "current";
  const PersonFiles files{capture, reconstructed, reconstructed};
  const CaptureInfo info = person_capture(files, options.input);  // as `track` corrects it
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
    const PersonalBody person =
        read_personal_body(workspace / "personalize" / "current" / "person.npz");
    const Retrack retrack{person.model, files, truth, info, sequence, options};
    const Exclude exclude = retrack.options.fit.exclude;
    const double dynamic =
        true_dynamic_share(capture, truth, sequence, retrack.options.fit.dynamic);
    measures.push_back({"track.dynamic_share", dynamic, "", 0, Measure::Side::None,
                        "of the body's vertices, under ground-truth clothing that swings"});
    // A fold that swings at a hem is no dynamic clothing.
    if (dynamic > kDynamicShare) {
      const double none = exclude == Exclude::None ? errors.legs : retrack(Exclude::None).legs;
      const double automatic = exclude == Exclude::Auto ? errors.legs : retrack(Exclude::Auto).legs;
      measures.push_back({"track.legs_none_mm", 1e3 * none, "mm", 0, Measure::Side::None,
                          "the same with exclude = none"});
      measures.push_back({"track.legs_ratio", automatic / none, "", 0.5, Measure::Side::AtMost,
                          "legs with exclude = auto over those with none"});
      if (wears(truth, labels_of(retrack.options.input.excluded))) {
        measures.push_back({"track.auto_ratio", automatic / retrack(Exclude::Labels).legs, "", 1.2,
                            Measure::Side::AtMost,
                            "legs with exclude = auto over those with true " +
                                retrack.options.input.excluded + " left out"});
      }
    }
    break;  // the first clothed sequence is judged
  }
  return measures;
}

}  // namespace atelier
