#include "bodymodel/formats/marker_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "bodymodel/formats/marker_head.h"
#include "bodymodel/formats/marker_names.h"
#include "bodymodel/formats/marker_pose.h"
#include "bodymodel/formats/marker_subjects.h"
#include "bodymodel/human/human_anatomy.h"
#include "bodymodel/human/human_rig.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/median.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr int kBodyJoints = 22;  // of the default human: what comes before jaw, eyes, fingers
constexpr int kFewest = 6;       // markers that make a pose
constexpr double kLengthSpread = 0.06;  // of a bone's length about the body's mean scale
constexpr double kSeenSpread = 0.002;   // of one seen between two joint centres
constexpr double kAslant = 0.17;        // radians of a band on the head that is levelled
constexpr double kBandHeight = 0.085;   // m above the head's joint, where no face is
constexpr double kBad = 0.04;           // m rms above which a frame is tried from other starts

// Bones that share one length factor, by the joint at their end.
enum Length { Hips, Trunk, Girdle, HeadLength, Thigh, Shin, Foot, UpperArm, Forearm };
constexpr int kLengths = 9;
constexpr std::array<int, kBodyJoints> kLengthOf = {
    -1,  // pelvis
    Hips,  Hips,   Trunk,  Thigh,      Thigh,  Trunk,  Shin,     Shin,     Trunk,   Foot,   Foot,
    Trunk, Girdle, Girdle, HeadLength, Girdle, Girdle, UpperArm, UpperArm, Forearm, Forearm};

// The subject: nominal places in metres at the middle build, and what is found of them.
struct Subject {
  Skeleton nominal;
  Skeleton skeleton;
  RidingMarkers nominal_markers;
  RidingMarkers markers;
  std::vector<bool> centre;  // [M]
  std::vector<int> columns;  // [M] of the clip
  std::array<double, kLengths> lengths = {};
  std::array<double, kLengths> seen_lengths = {};  // between joint centres, 0 where there are none
};

Skeleton body_skeleton(const HumanAnatomy& anatomy) {
  Skeleton skeleton = human_skeleton(anatomy);
  skeleton.names.resize(kBodyJoints);
  skeleton.parents.resize(kBodyJoints);
  skeleton.offsets.conservativeResize(kBodyJoints, 3);
  skeleton.limits_min.conservativeResize(kBodyJoints, 3);
  skeleton.limits_max.conservativeResize(kBodyJoints, 3);
  return skeleton;
}

bool on_trunk(const Subject& subject, std::size_t marker) {
  const std::string& name =
      subject.skeleton.names[static_cast<std::size_t>(subject.markers.joints[marker])];
  return name == "pelvis" || name.starts_with("spine") || name == "neck" ||
         name.ends_with("collar") ||
         (subject.centre[marker] && (name.ends_with("hip") || name.ends_with("shoulder")));
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size() && i < 12; ++i) {
    text += (i > 0 ? ", " : "") + names[i].substr(0, 40);
  }
  return text + (names.size() > 12 ? ", ..." : "");
}

// Which parts of a person some markers are on.
struct PersonParts {
  bool pelvis = false;
  std::array<bool, 2> legs = {};
  int places = 0;

  void add(const MarkerPlace& place) {
    ++places;
    pelvis = pelvis || place.joint == "pelvis" || place.joint.ends_with("_hip");
    for (const char* part : {"knee", "ankle", "foot"}) {
      legs[0] = legs[0] || place.joint == std::string("left_") + part;
      legs[1] = legs[1] || place.joint == std::string("right_") + part;
    }
  }
  bool whole() const { return pelvis && legs[0] && legs[1] && places >= kFewest; }
};

// The columns of a clip by the subject that their names begin with.
using Subjects = std::map<std::string, std::vector<std::size_t>>;

Subjects subjects_of(const MarkerClip& clip) {
  Subjects subjects;
  for (std::size_t m = 0; m < clip.markers.size(); ++m) {
    subjects[marker_subject(clip.markers[m])].push_back(m);
  }
  return subjects;
}

MarkerClip some_markers(const MarkerClip& clip, const std::vector<std::size_t>& columns) {
  MarkerClip some;
  some.name = clip.name;
  some.fps = clip.fps;
  some.metres_per_unit = clip.metres_per_unit;
  some.frame_ids = clip.frame_ids;
  for (const std::size_t m : columns) {
    some.markers.push_back(clip.markers[m]);
  }
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    Points positions(static_cast<Index>(columns.size()), 3);
    std::vector<bool> seen;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      positions.row(static_cast<Index>(i)) = clip.positions[f].row(static_cast<Index>(columns[i]));
      seen.push_back(clip.seen[f][columns[i]]);
    }
    some.positions.push_back(std::move(positions));
    some.seen.push_back(std::move(seen));
  }
  return some;
}

std::vector<std::optional<MarkerPlace>> places_of(const MarkerClip& clip,
                                                  const std::vector<std::size_t>& columns) {
  std::vector<std::string> names;
  names.reserve(columns.size());
  for (const std::size_t m : columns) {
    names.push_back(clip.markers[m]);
  }
  return marker_places(names);
}

// Whether two subjects have a marker of one name, so that they are no parts of one person.
bool share_names(const MarkerClip& clip, const Subjects& subjects) {
  std::set<std::string> names;
  for (const auto& [subject, columns] : subjects) {
    const std::vector<std::optional<MarkerPlace>> places = places_of(clip, columns);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const std::string& marker = clip.markers[columns[i]];
      const std::string name = marker.substr(subject.empty() ? 0 : subject.size() + 1);
      if (places[i] && !names.insert(name).second) {
        return true;
      }
    }
  }
  return false;
}

// Who is in a clip.
struct Cast {
  Subjects subjects;
  std::vector<std::string> all;     // as a reader is told of them
  std::vector<std::string> people;  // those whose markers make a person
  bool one = true;  // one body: a single subject, or parts of a person under several names
};

Cast cast_of(const MarkerClip& clip) {
  Cast cast;
  cast.subjects = subjects_of(clip);
  for (const auto& [subject, columns] : cast.subjects) {
    PersonParts parts;
    for (const std::optional<MarkerPlace>& place : places_of(clip, columns)) {
      if (place) {
        parts.add(*place);
      }
    }
    cast.all.push_back(subject.empty() ? "(without a name)" : subject);
    if (parts.whole()) {
      cast.people.push_back(subject);
    }
  }
  cast.one = cast.subjects.size() < 2 || (cast.people.empty() && !share_names(clip, cast.subjects));
  return cast;
}

// How one of several is asked for.
std::string choice_of(const Cast& cast) {
  const std::string one =
      cast.all.front() == "(without a name)" ? cast.all.back() : cast.all.front();
  return "--markers.subject '" + one.substr(0, 40) +
         "' of body-model takes one of them, and convert writes it as a motion";
}

Finding the_one_person(const Cast& cast, const std::string& file) {
  return {Severity::Note, "motion-subjects", file,
          "markers of several subjects: " + listed(cast.all),
          "'" + cast.people[0].substr(0, 40) + "' is the person; the others are left out"};
}

// The markers of the one person that is asked for or there.
MarkerClip one_person(const MarkerClip& clip, const std::string& wanted,
                      std::vector<Finding>& findings) {
  const Cast cast = cast_of(clip);
  if (!wanted.empty()) {
    const auto found = cast.subjects.find(wanted);
    if (found == cast.subjects.end()) {
      throw UnknownValue(
          clip.name, "subject", wanted,
          "one of " + listed(cast.all) + ", which stand before a colon in the names");
    }
    return some_markers(clip, found->second);
  }
  if (cast.one) {
    return clip;
  }
  if (cast.people.size() != 1) {
    throw DataError(
        clip.name, "names of the markers",
        "markers of " + std::to_string(cast.all.size()) + " subjects: " + listed(cast.all),
        "one person; " + choice_of(cast));
  }
  findings.push_back(the_one_person(cast, clip.name));
  return some_markers(clip, cast.subjects.at(cast.people[0]));
}

Subject recognised_subject(const MarkerClip& clip, MarkerFit& fit) {
  const HumanAnatomy anatomy = human_anatomy({});
  const double k = anatomy.build.stature / 1000;
  Subject subject;
  subject.nominal = body_skeleton(anatomy);
  subject.skeleton = subject.nominal;
  std::vector<Eigen::Vector3d> offsets;
  PersonParts parts;
  const std::vector<std::optional<MarkerPlace>> places = marker_places(clip.markers);
  for (std::size_t m = 0; m < clip.markers.size(); ++m) {
    const std::optional<MarkerPlace>& place = places[m];
    if (!place) {
      fit.unknown.push_back(clip.markers[m]);
      continue;
    }
    fit.used.push_back(clip.markers[m]);
    subject.columns.push_back(static_cast<int>(m));
    subject.centre.push_back(place->centre);
    subject.nominal_markers.joints.push_back(find_joint(subject.nominal, place->joint));
    offsets.push_back(k * place->offset);
    parts.add(*place);
  }
  if (!parts.whole()) {
    throw DataError(
        clip.name, "names of the markers",
        std::to_string(fit.used.size()) + " of " + std::to_string(clip.markers.size()) +
            " that mean a place on a person: " + listed(clip.markers),
        "six or more, with pelvis or hips and a knee, ankle or foot of both legs, named "
        "as joint-centre files (RHip, LKnee), Plug-in Gait (LASI, RKNE) or OpenSim "
        "(R.ASIS, L.Knee.Lat) have them");
  }
  subject.nominal_markers.offsets.resize(static_cast<Index>(offsets.size()), 3);
  for (std::size_t m = 0; m < offsets.size(); ++m) {
    subject.nominal_markers.offsets.row(static_cast<Index>(m)) = offsets[m].transpose();
  }
  subject.markers = subject.nominal_markers;
  return subject;
}

// Recorded positions of the markers that are used, in metres, Y up.
struct Recorded {
  std::vector<Points> targets;
  std::vector<std::vector<bool>> seen;
  std::vector<int> counts;
};

Recorded recorded(const MarkerClip& clip, const Subject& subject) {
  Recorded all;
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    Points targets(static_cast<Index>(subject.columns.size()), 3);
    std::vector<bool> seen;
    for (std::size_t m = 0; m < subject.columns.size(); ++m) {
      targets.row(static_cast<Index>(m)) = clip.positions[f].row(subject.columns[m]);
      seen.push_back(clip.seen[f][static_cast<std::size_t>(subject.columns[m])]);
    }
    all.counts.push_back(static_cast<int>(std::count(seen.begin(), seen.end(), true)));
    all.targets.push_back(std::move(targets));
    all.seen.push_back(std::move(seen));
  }
  return all;
}

char guess_up(const Recorded& all, const Subject& subject) {
  const Points rest = marker_positions(
      subject.nominal_markers, forward_kinematics(subject.nominal, rest_pose(subject.nominal)));
  // The direction from low markers to high ones.
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (std::size_t f = 0; f < all.targets.size(); ++f) {
    double mean = 0;
    Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
    int count = 0;
    for (Index m = 0; m < rest.rows(); ++m) {
      if (all.seen[f][static_cast<std::size_t>(m)]) {
        mean += rest(m, 1);
        middle += all.targets[f].row(m);
        ++count;
      }
    }
    for (Index m = 0; m < rest.rows() && count > 0; ++m) {
      if (all.seen[f][static_cast<std::size_t>(m)]) {
        up += (rest(m, 1) - mean / count) * (all.targets[f].row(m) - middle / count).transpose();
      }
    }
  }
  return std::abs(up.z()) > std::abs(up.y()) ? 'z' : 'y';
}

// Observed over nominal distance between markers on neighbouring joints, the median.
double mean_scale(const Recorded& all, const Subject& subject) {
  const Points rest = marker_positions(
      subject.nominal_markers, forward_kinematics(subject.nominal, rest_pose(subject.nominal)));
  const std::vector<int>& joints = subject.nominal_markers.joints;
  std::vector<double> ratios;
  const std::size_t step = std::max<std::size_t>(1, all.targets.size() / 50);
  for (std::size_t a = 0; a < joints.size(); ++a) {
    for (std::size_t b = a + 1; b < joints.size(); ++b) {
      const auto parent = [&](std::size_t m) {
        return subject.nominal.parents[static_cast<std::size_t>(joints[m])];
      };
      const Index ra = static_cast<Index>(a);
      const Index rb = static_cast<Index>(b);
      const double nominal = (rest.row(ra) - rest.row(rb)).norm();
      const bool near = joints[a] == joints[b] || parent(a) == joints[b] || parent(b) == joints[a];
      if (!near || nominal < 0.08) {
        continue;
      }
      for (std::size_t f = 0; f < all.targets.size(); f += step) {
        if (all.seen[f][a] && all.seen[f][b]) {
          ratios.push_back((all.targets[f].row(ra) - all.targets[f].row(rb)).norm() / nominal);
        }
      }
    }
  }
  if (ratios.empty()) {
    return 0;
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  return ratios[ratios.size() / 2];
}

// Length factors of bones that have a joint centre at both ends (hips: from one to the other), the
// median over frames and sides.
std::array<double, kLengths> seen_lengths(const Recorded& all, const Subject& subject) {
  const Points rest = rest_positions(subject.nominal);
  const std::vector<int>& joints = subject.nominal_markers.joints;
  std::array<std::vector<double>, kLengths> ratios;
  for (std::size_t a = 0; a < joints.size(); ++a) {
    for (std::size_t b = 0; b < joints.size(); ++b) {
      const std::size_t child = static_cast<std::size_t>(joints[a]);
      const bool bone = subject.nominal.parents[child] == joints[b];
      const bool hips = kLengthOf[child] == Hips && joints[b] > joints[a] &&
                        kLengthOf[static_cast<std::size_t>(joints[b])] == Hips;
      if (!subject.centre[a] || !subject.centre[b] || (!bone && !hips)) {
        continue;
      }
      const double nominal = (rest.row(joints[a]) - rest.row(joints[b])).norm();
      for (std::size_t f = 0; f < all.targets.size(); ++f) {
        if (all.seen[f][a] && all.seen[f][b]) {
          ratios[static_cast<std::size_t>(kLengthOf[child])].push_back(
              (all.targets[f].row(static_cast<Index>(a)) -
               all.targets[f].row(static_cast<Index>(b)))
                  .norm() /
              nominal);
        }
      }
    }
  }
  std::array<double, kLengths> lengths = {};
  for (std::size_t l = 0; l < kLengths; ++l) {
    if (!ratios[l].empty()) {
      const auto middle = ratios[l].begin() + static_cast<std::ptrdiff_t>(ratios[l].size() / 2);
      std::nth_element(ratios[l].begin(), middle, ratios[l].end());
      lengths[l] = *middle;
    }
  }
  return lengths;
}

// The turn and shift of the rest pose that brings the trunk's markers nearest (Kabsch 1976).
Pose trunk_start(const Subject& subject, const Pose& base, const Points& targets,
                 const std::vector<bool>& seen) {
  const Points at = marker_positions(subject.markers, forward_kinematics(subject.skeleton, base));
  std::vector<Index> rows;
  for (const bool trunk_only : {true, false}) {
    rows.clear();
    for (Index m = 0; m < at.rows(); ++m) {
      const std::size_t i = static_cast<std::size_t>(m);
      if (seen[i] && (!trunk_only || on_trunk(subject, i))) {
        rows.push_back(m);
      }
    }
    if (rows.size() >= 4) {
      break;
    }
  }
  Eigen::RowVector3d from = Eigen::RowVector3d::Zero();
  Eigen::RowVector3d to = Eigen::RowVector3d::Zero();
  for (const Index m : rows) {
    from += at.row(m) / static_cast<double>(rows.size());
    to += targets.row(m) / static_cast<double>(rows.size());
  }
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const Index m : rows) {
    moments += (targets.row(m) - to).transpose() * (at.row(m) - from);
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moments, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
  flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d turn = svd.matrixU() * flip * svd.matrixV().transpose();
  Pose pose = base;
  pose.rotations.row(0) = rotation_vector(turn).transpose();
  // The root turns about its own joint.
  const Eigen::Vector3d root = subject.skeleton.offsets.row(0);
  pose.root_translation = to.transpose() - root - turn * (from.transpose() - root);
  return pose;
}

// Plain poses to start from: rest, arms forward, arms up, seated, each leg raised.
std::vector<Pose> plain_poses(const Skeleton& skeleton) {
  struct Turn {
    const char* joint;
    double x, y, z;
  };
  const std::vector<std::vector<Turn>> turns = {
      {},
      {{"left_shoulder", 0, -1.2, 0.6}, {"right_shoulder", 0, 1.2, -0.6}},
      {{"left_shoulder", 0, 0, 1.7}, {"right_shoulder", 0, 0, -1.7}},
      {{"left_hip", -1.5, 0, 0},
       {"right_hip", -1.5, 0, 0},
       {"left_knee", 1.5, 0, 0},
       {"right_knee", 1.5, 0, 0}},
      {{"left_hip", -1.3, 0, 0}, {"left_knee", 1.3, 0, 0}},
      {{"right_hip", -1.3, 0, 0}, {"right_knee", 1.3, 0, 0}}};
  std::vector<Pose> poses;
  for (const std::vector<Turn>& list : turns) {
    Pose pose = rest_pose(skeleton);
    for (const Turn& turn : list) {
      pose.rotations.row(find_joint(skeleton, turn.joint)) << turn.x, turn.y, turn.z;
    }
    poses.push_back(pose);
  }
  return poses;
}

MarkerPose best_pose(const Subject& subject, const Points& targets, const std::vector<bool>& seen,
                     const Pose* before, const MarkerPoseOptions& options) {
  MarkerPose best;
  best.rms = 1e30;
  if (before != nullptr) {
    best = fit_pose(subject.skeleton, subject.markers, targets, seen, *before, options);
  }
  if (best.rms > kBad) {
    for (const Pose& plain : plain_poses(subject.skeleton)) {
      const Pose start = trunk_start(subject, plain, targets, seen);
      const MarkerPose found =
          fit_pose(subject.skeleton, subject.markers, targets, seen, start, options);
      if (found.rms < 0.9 * best.rms) {
        best = found;
      }
    }
  }
  return best;
}

void apply_lengths(Subject& subject) {
  for (int j = 1; j < kBodyJoints; ++j) {
    subject.skeleton.offsets.row(j) =
        subject.lengths[static_cast<std::size_t>(kLengthOf[static_cast<std::size_t>(j)])] *
        subject.nominal.offsets.row(j);
  }
}

// Lengths and skin places that fit the poses of some frames: positions are linear in them.
void measure(Subject& subject, const Recorded& all, const std::vector<std::size_t>& frames,
             const std::vector<Pose>& poses, double scale, const MarkerFitOptions& options) {
  const Index count = static_cast<Index>(subject.columns.size());
  const Index unknowns = kLengths + 3 * count;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const JointFrames now = forward_kinematics(subject.skeleton, poses[i]);
    const std::vector<bool>& seen = all.seen[frames[i]];
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3 * count, unknowns);
    Eigen::VectorXd values = Eigen::VectorXd::Zero(3 * count);
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(3, unknowns);
    Eigen::Vector3d mean_value = Eigen::Vector3d::Zero();
    double visible = 0;
    for (Index m = 0; m < count; ++m) {
      if (!seen[static_cast<std::size_t>(m)]) {
        continue;
      }
      const int carrier = subject.markers.joints[static_cast<std::size_t>(m)];
      for (int joint = carrier; joint > 0;
           joint = subject.nominal.parents[static_cast<std::size_t>(joint)]) {
        const int parent = subject.nominal.parents[static_cast<std::size_t>(joint)];
        const Eigen::Vector3d bone = subject.nominal.offsets.row(joint);
        rows.block<3, 1>(3 * m, kLengthOf[static_cast<std::size_t>(joint)]) +=
            now.rotations[static_cast<std::size_t>(parent)] * bone;
      }
      rows.block<3, 3>(3 * m, kLengths + 3 * m) = now.rotations[static_cast<std::size_t>(carrier)];
      values.segment<3>(3 * m) = all.targets[frames[i]].row(m).transpose();
      mean += rows.middleRows(3 * m, 3);
      mean_value += values.segment<3>(3 * m);
      visible += 1;
    }
    // The best shift of the frame is the mean gap: rows about their mean know no shift.
    for (Index m = 0; m < count; ++m) {
      if (seen[static_cast<std::size_t>(m)]) {
        rows.middleRows(3 * m, 3) -= mean / visible;
        values.segment<3>(3 * m) -= mean_value / visible;
      }
    }
    normal += rows.transpose() * rows;
    right += rows.transpose() * values;
  }
  const double trust =
      static_cast<double>(frames.size()) * options.noise * options.noise;  // of one prior
  const auto prior = [&](Index unknown, double value, double spread) {
    const double weight = trust / (spread * spread);
    normal(unknown, unknown) += weight;
    right[unknown] += weight * value;
  };
  for (int l = 0; l < kLengths; ++l) {
    const double known = subject.seen_lengths[static_cast<std::size_t>(l)];
    prior(l, known > 0 ? known : scale, (known > 0 ? kSeenSpread : kLengthSpread) * scale);
  }
  for (Index m = 0; m < count; ++m) {
    for (Index c = 0; c < 3; ++c) {
      const bool fixed = subject.centre[static_cast<std::size_t>(m)] || options.offset_freedom <= 0;
      prior(kLengths + 3 * m + c, scale * subject.nominal_markers.offsets(m, c),
            fixed ? 1e-5 : options.offset_freedom);
    }
  }
  const Eigen::VectorXd found = normal.ldlt().solve(right);
  for (int l = 0; l < kLengths; ++l) {
    subject.lengths[static_cast<std::size_t>(l)] =
        std::clamp(found[l], 0.4 * scale, 2.0 * scale);  // no bone turns round
  }
  for (Index m = 0; m < count; ++m) {
    subject.markers.offsets.row(m) = found.segment<3>(kLengths + 3 * m).transpose();
  }
  apply_lengths(subject);
}

// Frames that see most, spread over the clip.
std::vector<std::size_t> calibration_frames(const Recorded& all, int wanted) {
  const std::size_t count = all.targets.size();
  const std::size_t parts = std::min<std::size_t>(count, static_cast<std::size_t>(wanted));
  std::vector<std::size_t> frames;
  for (std::size_t p = 0; p < parts; ++p) {
    const std::size_t end = (p + 1) * count / parts;
    std::size_t best = p * count / parts;
    for (std::size_t f = best; f < end; ++f) {
      best = all.counts[f] > all.counts[best] ? f : best;
    }
    if (all.counts[best] >= kFewest) {
      frames.push_back(best);
    }
  }
  return frames;
}

// How far a position of a frame's markers is from their middle, axis by axis, which one that is
// anywhere does not move.
std::vector<double> from_the_middle(const Points& positions, const std::vector<bool>& seen,
                                    const std::vector<int>& columns) {
  Eigen::RowVector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const int m : columns) {
      if (seen[static_cast<std::size_t>(m)]) {
        values.push_back(positions(m, axis));
      }
    }
    middle[axis] = median(std::move(values));
  }
  std::vector<double> distances;
  distances.reserve(columns.size());
  for (const int m : columns) {
    distances.push_back(seen[static_cast<std::size_t>(m)] ? (positions.row(m) - middle).norm() : 0);
  }
  return distances;
}

// Takes for unseen what no part of the person reaches from the others, and tells whose it was.
// `metre` is one of the person's, in the unit of the positions.
std::optional<Finding> lose_markers_beyond_reach(const Subject& subject, double metre,
                                                 MarkerClip& clip) {
  constexpr double kReach = 2.5;  // m, of a person of 1.7 m; from foot to raised hand they are 2.2
  constexpr std::size_t kNamed = 6;
  std::map<int, int> frames;  // by column
  double farthest = 0;
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    const std::vector<double> distances =
        from_the_middle(clip.positions[f], clip.seen[f], subject.columns);
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] > kReach * metre) {
        const int m = subject.columns[i];
        farthest = std::max(farthest, distances[i]);
        ++frames[m];
        clip.seen[f][static_cast<std::size_t>(m)] = false;
        clip.positions[f].row(m).setZero();
      }
    }
  }
  if (frames.empty()) {
    return std::nullopt;
  }
  std::string names;
  std::size_t named = 0;
  for (const auto& [m, count] : frames) {
    if (named++ < kNamed) {
      names += (names.empty() ? "" : ", ") +
               clip.markers[static_cast<std::size_t>(m)].substr(0, 40) + " in " +
               counted(count, "frame");
    }
  }
  if (named > kNamed) {
    names += " and " + counted(static_cast<std::int64_t>(named - kNamed), "other marker");
  }
  return Finding{Severity::Warning, "motion-markers-reach", clip.name,
                 "beyond a person's reach, up to " + short_number(farthest / metre) +
                     " m from the other markers: " + names,
                 "taken for not seen there; correct or blank them in the file"};
}

// Brings the clip to metres and Y up; says what was guessed.
MarkerClip in_our_axes(MarkerClip clip, const Subject& subject, const MotionOptions& motion,
                       std::vector<Finding>& findings) {
  double factor = motion.metres_per_unit > 0 ? motion.metres_per_unit / clip.metres_per_unit : 1;
  const double metre = mean_scale(recorded(clip, subject), subject);
  const double scale = metre * factor;
  if (!(scale > 0)) {
    throw DataError(clip.name, "markers", "no two of one limb seen together, or all in one place",
                    "a person's markers");
  }
  if (const auto far = lose_markers_beyond_reach(subject, metre, clip)) {
    findings.push_back(*far);
  }
  if (motion.metres_per_unit == 0 && (scale < 0.4 || scale > 1.6)) {
    double best = 1 / scale;
    for (const double unit : {1000.0, 100.0, 1 / 0.0254, 10.0, 0.1, 0.0254, 0.01, 0.001}) {
      if (std::abs(std::log(unit * scale)) < std::log(1.5)) {
        best = unit;
      }
    }
    factor *= best;
    findings.push_back({Severity::Warning, "motion-unit", clip.name,
                        "the header's unit makes a person of " + short_number(1.7 * scale) +
                            " m; positions are multiplied by " + short_number(best),
                        "correct Units in the file, or set --motion.metres-per-unit"});
  }
  const char up = motion.up != 0 ? motion.up : guess_up(recorded(clip, subject), subject);
  if (motion.up == 0 && up != 'y') {
    findings.push_back({Severity::Note, "motion-up", clip.name, "z taken as up",
                        "--motion.up y if that is wrong"});
  }
  for (Points& positions : clip.positions) {
    positions *= factor;
    if (up == 'z') {
      const Eigen::VectorXd y = positions.col(1);
      positions.col(1) = positions.col(2);
      positions.col(2) = -y;
    }
  }
  return clip;
}

// Turns the named places of a band of markers round the head so that it looks ahead on average.
void level_head(const Recorded& all, const std::string& name, Subject& subject,
                std::vector<Finding>& findings) {
  Points& places = subject.nominal_markers.offsets;
  std::vector<std::size_t> band;
  for (std::size_t m = 0; m < subject.centre.size(); ++m) {
    if (subject.nominal_markers.joints[m] == find_joint(subject.nominal, "head")) {
      if (places(static_cast<Index>(m), 1) < kBandHeight) {
        return;  // markers on the face say themselves where it looks
      }
      band.push_back(m);
    }
  }
  const double pitch = head_pitch(places, band, all.targets, all.seen);
  if (std::abs(pitch) >= kAslant) {
    places = levelled(places, band, pitch);
    findings.push_back({Severity::Note, "motion-markers-head", name,
                        "the markers on the head are aslant by " +
                            short_number(std::abs(pitch) * 180 / std::numbers::pi, 2) +
                            " degrees on average",
                        "taken as worn so, by a person who looks ahead"});
  }
}

PlacedMarkers placed_markers(const Subject& subject) {
  const Points rest = rest_positions(subject.nominal);
  PlacedMarkers markers{subject.columns, subject.nominal_markers.joints,
                        subject.nominal_markers.offsets};
  for (std::size_t m = 0; m < markers.segments.size(); ++m) {
    int& joint = markers.segments[m];
    markers.rest.row(static_cast<Index>(m)) += rest.row(joint);
    if (subject.nominal.names[static_cast<std::size_t>(joint)].ends_with("_foot")) {
      joint = subject.nominal.parents[static_cast<std::size_t>(joint)];  // toes beside heels
    }
  }
  return markers;
}

}  // namespace

OptionTable describe(MarkerFitOptions& options) {
  OptionTable table;
  table.add(
      "subject", options.subject, {},
      "Subject whose markers are taken of a file of several people, as its name stands before "
      "the colon; empty: the one person in it");
  table.add("noise", options.noise, 1e-4, 0.1, "m",
            "Standard deviation of a marker's position; 0.02 for detected keypoints");
  table.add("offset_freedom", options.offset_freedom, 0, 0.2, "m",
            "Standard deviation of a skin marker's offset from its nominal place on the body");
  table.add("limits", options.limits, "Joint limits of the default human");
  table.add("calibration_frames", options.calibration_frames, 1, 1000, "",
            "Number of frames from which bone lengths and marker offsets are estimated");
  table.add("rounds", options.rounds, 1, 100, "",
            "Number of alternations between estimating bone lengths and poses");
  return table;
}

std::optional<Finding> subjects_finding(const MarkerClip& clip) {
  const Cast cast = cast_of(clip);
  if (cast.one) {
    return std::nullopt;
  }
  if (cast.people.size() == 1) {
    return the_one_person(cast, clip.name);
  }
  std::vector<std::string> counts;
  for (const std::string& name : cast.people.empty() ? cast.all : cast.people) {
    const auto found = cast.subjects.find(name);
    counts.push_back(found == cast.subjects.end()
                         ? name
                         : name + " (" + std::to_string(found->second.size()) + " markers)");
  }
  return Finding{Severity::Warning, "motion-subjects", clip.name,
                 cast.people.empty() ? "markers of " + std::to_string(counts.size()) +
                                           " subjects: " + listed(counts)
                                     : std::to_string(counts.size()) + " people: " + listed(counts),
                 choice_of(cast)};
}

std::optional<Finding> reach_finding(const MarkerClip& clip) {
  MarkerFit fit;
  std::vector<Finding> findings;
  try {
    MarkerClip person = one_person(clip, "", findings);
    const Subject subject = recognised_subject(person, fit);
    const double metre = mean_scale(recorded(person, subject), subject);
    return metre > 0 ? lose_markers_beyond_reach(subject, metre, person) : std::nullopt;
  } catch (const DataError&) {  // nobody's markers, of whom there is no reach
    return std::nullopt;
  }
}

MarkerFit fit_markers(const MarkerClip& original, const MotionOptions& motion,
                      const MarkerFitOptions& options) {
  ATELIER_CHECK(motion.up == 0 || motion.up == 'y' || motion.up == 'z', "up is 'y' or 'z'");
  ATELIER_CHECK(options.noise > 0 && options.calibration_frames > 0 && options.rounds > 0,
                "noise, calibration frames and rounds are positive");
  MarkerFit fit;
  fit.clip.findings = original.findings;
  const MarkerClip person = one_person(original, options.subject, fit.clip.findings);
  Subject subject = recognised_subject(person, fit);
  const MarkerClip clip = in_our_axes(person, subject, motion, fit.clip.findings);
  if (const auto mirrored = mirrored_finding(clip, placed_markers(subject))) {
    fit.clip.findings.push_back(*mirrored);
  }
  const Recorded all = recorded(clip, subject);
  level_head(all, clip.name, subject, fit.clip.findings);
  const std::vector<std::size_t> frames = calibration_frames(all, options.calibration_frames);
  if (frames.empty()) {
    throw DataError(clip.name, "markers", "no frame that sees six of them", "a person's markers");
  }
  const double scale = mean_scale(all, subject);
  subject.lengths.fill(scale);
  subject.seen_lengths = seen_lengths(all, subject);
  subject.markers.offsets = scale * subject.nominal_markers.offsets;
  subject.skeleton.offsets.row(0) = scale * subject.nominal.offsets.row(0);
  apply_lengths(subject);

  MarkerPoseOptions posing;
  posing.noise = options.noise;
  posing.limits = options.limits;
  MarkerPoseOptions rough = posing;  // the next round goes on from there
  rough.iterations = 15;
  std::vector<Pose> poses(frames.size());
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Pose* before = round > 0 ? &poses[i] : i > 0 ? &poses[i - 1] : nullptr;
      poses[i] =
          best_pose(subject, all.targets[frames[i]], all.seen[frames[i]], before, rough).pose;
    }
    measure(subject, all, frames, poses, scale, options);
  }

  MotionClip& result = fit.clip;
  result.name = clip.name;
  result.skeleton = subject.skeleton;
  result.motion.fps = motion.fps > 0 ? motion.fps : clip.fps;
  result.motion.frame_ids = clip.frame_ids;
  int blind = 0;
  double squares = 0;
  Pose before = poses.front();
  bool first = true;
  for (std::size_t f = 0; f < all.targets.size(); ++f) {
    if (all.counts[f] >= kFewest) {
      const MarkerPose found =
          best_pose(subject, all.targets[f], all.seen[f], first ? nullptr : &before, posing);
      before = found.pose;
      fit.rms.push_back(found.rms);
      squares += found.rms * found.rms;
      first = false;
    } else {
      fit.rms.push_back(0);
      ++blind;
    }
    result.motion.poses.push_back(before);
  }
  const double rms =
      std::sqrt(squares / std::max(1.0, static_cast<double>(all.targets.size()) - blind));
  result.findings.push_back(
      {Severity::Note, "motion-markers", clip.name,
       std::to_string(fit.used.size()) + " of " + std::to_string(clip.markers.size()) +
           " markers posed a person, " + short_number(1000 * rms, 3) + " mm rms from them" +
           (fit.unknown.empty() ? "" : "; not known: " + listed(fit.unknown)),
       fit.unknown.empty()
           ? "nothing to do"
           : "rename markers that should count (docs/methods/bodies.md lists the sets)"});
  if (rms > kBad) {
    result.findings.push_back(
        {Severity::Warning, "motion-markers-far", clip.name,
         "the pose misses the markers by " + short_number(1000 * rms, 3) + " mm rms",
         "look for swapped sides or names of another marker set"});
  }
  if (blind > 0) {
    result.findings.push_back({Severity::Warning, "motion-markers-unseen", clip.name,
                               std::to_string(blind) + " frames see fewer than six markers",
                               "they keep to the frame before"});
  }
  return fit;
}

}  // namespace atelier
