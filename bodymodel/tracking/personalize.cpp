#include "bodymodel/tracking/personalize.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "bodymodel/bone_lengths.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/measure.h"
#include "bodymodel/tracking/keypoint_unit.h"
#include "bodymodel/tracking/solve_shape.h"
#include "bodymodel/tracking/start_pose.h"
#include "bodymodel/tracking/thickness.h"
#include "core/error.h"
#include "core/laplacian.h"
#include "core/listed_frames.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr int kFewFrames = 3;
constexpr double kUnseenWorth = 0.02;      // share of the surface that is worth a word
constexpr double kMirrorReach = 0.01;      // m
constexpr double kMirrorNoise = 0.006;     // m, by which the two sides of a body differ
constexpr double kOutlier = 0.02;          // m off the surface that is another thing
constexpr double kBoneRoom = 4.5;          // ranges beyond its own that a bone may differ by
constexpr double kThicknessSpread = 0.07;  // share by which girths of one stature differ
constexpr int kKeypointIterations = 20;
constexpr int kRoundIterations = 8;

// A limb of 0.7 to 1.6 times the usual girth: what body mass indices of 12 and 60 about one of 23
// make of it.
constexpr double kThinnest = 0.7;
constexpr double kThickest = 1.6;

/// A person's measurements, if the skin can be measured.
std::optional<BodyMeasurements> measures_of(BodyModel person) {
  person.skeleton = with_smpl_names(person.skeleton, recognised_humanoid(person.skeleton));
  if (find_joint(person.skeleton, "neck") < 0) {
    return std::nullopt;
  }
  try {
    return measure_body(person);
  } catch (const DataError&) {
    return std::nullopt;
  }
}

std::string rounded(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

/// Girths of limbs, and mass, that nobody of that stature has, beside those of the usual body.
std::vector<Finding> implausible(const BodyMeasurements& found, const BodyMeasurements& usual) {
  std::vector<Finding> findings;
  const auto judge = [&](const std::string& name, double value, double least, double most,
                         const std::string& unit, int digits) {
    if (value < least || value > most) {
      findings.push_back({Severity::Warning, "measure-implausible", "person",
                          name + " of " + rounded(value, digits) + " " + unit + "; " +
                              rounded(least, digits) + " to " + rounded(most, digits) +
                              " are of people of that stature",
                          "look at the person's image before trusting its surface"});
    }
  };
  const double size = std::sqrt(found.stature / usual.stature);
  for (const NamedMeasurement& one : measurement_names()) {
    if (one.name == "thigh_girth" || one.name == "calf_girth" || one.name == "upper_arm_girth" ||
        one.name == "forearm_girth") {
      const double expected = size * (usual.*one.value);
      judge(one.name, found.*one.value, kThinnest * expected, kThickest * expected, one.unit, 3);
    }
  }
  if (found.mass > 0) {
    const double square = found.stature * found.stature;
    judge("mass", found.mass, kMinMassIndex * square, kMaxMassIndex * square, "kg", 1);
  }
  return findings;
}

/// Distances of scans from every vertex, along its normal.
struct Field {
  Eigen::VectorXd sum;      // weighted distances
  Eigen::VectorXd weight;   // in points
  Eigen::VectorXd support;  // frames
};

class Personalizer {
 public:
  Personalizer(const BodyModel& model, const TrackInput& input, const PersonalizeOptions& options)
      : model_(options.bone_lengths > 0 ? with_bone_lengths(model, options.bone_lengths) : model),
        own_shapes_(static_cast<Index>(model.shape.size())),
        input_(input),
        options_(options) {}

  Personalization run() {
    start();
    fit_shape();
    PersonalBody person = plain_person(model_, shape_);
    displace(person);
    return finished(std::move(person));
  }

 private:
  std::size_t frames() const { return input_.frames.size(); }

  /// Poses from keypoints, at the neutral shape first and then at the shape that they show.
  void start() {
    shape_ = neutral_shape(model_);
    person_ = fitted_person(model_, input_.keypoint_names);
    if (!model_.shape.empty()) {
      person_ = with_shape(person_, shape_);
    }
    std::vector<FrameTargets> seen;
    for (std::size_t f = 0; f < frames(); ++f) {
      FrameTargets one;
      one.keypoints = input_.frames[f].keypoints;
      one.deviations = input_.frames[f].deviations;
      seen.push_back(std::move(one));
      times_.push_back(input_.frame_ids[f] / input_.fps);
    }
    FrameWeights rough = options_.weights;  // bones may be a tenth longer
    rough.keypoint = std::max(rough.keypoint, 0.02);
    rough.keypoint_outlier = std::max(rough.keypoint_outlier, 0.15);
    const OtherUnits others = without_other_units(seen);
    const std::vector<StartPose> starts = start_poses(person_, seen, times_, rough);
    const BodySurface rest = rest_surface(person_);
    std::vector<int> untrusted;
    std::vector<int> sized;
    std::vector<int> far;
    double farthest = 0;
    for (std::size_t f = 0; f < frames(); ++f) {
      if (!starts[f].trusted) {
        if (!others.is_one(f)) {  // which has a finding of its own
          untrusted.push_back(input_.frame_ids[f]);
        }
        continue;
      }
      used_.push_back(f);
      const ScanPoints& scan = input_.frames[f].scan;
      scans_.push_back(scan.points.rows() > 0 ? &scan : nullptr);
      if (scans_.back() != nullptr && !scan_size_problem(scan, person_.shaped.vertices).empty()) {
        scans_.back() = nullptr;
        sized.push_back(input_.frame_ids[f]);
      }
      if (scans_.back() != nullptr) {
        const double off = foreign_share(person_, posed_surface(person_, rest, starts[f].x), scan);
        if (off > kFarShare) {
          far.push_back(input_.frame_ids[f]);
          farthest = std::max(farthest, off);
        }
        if (off >= 1) {  // no evidence at all, and not one that leaves the shape to chance
          scans_.back() = nullptr;
        }
      }
      targets_.push_back(starts[f].targets);
      x_.push_back(starts[f].x);
    }
    Finding unit;
    if (!others.frames.empty()) {
      unit = keypoint_unit(others, input_.frame_ids, "their frames say nothing of the person");
      findings_.push_back(unit);
    }
    if (!untrusted.empty()) {
      findings_.push_back({Severity::Warning, "frame-untrusted",
                           "frames " + listed_frames(untrusted),
                           "too few keypoints, or they contradict each other",
                           "left out of the person's measures"});
    }
    if (!sized.empty()) {
      findings_.push_back({Severity::Warning, "scan-unit", "frames " + listed_frames(sized),
                           "scans of another size than a person has",
                           "left out; look whether they are in millimetres"});
    }
    if (!far.empty()) {
      findings_.push_back({Severity::Warning, "scan-far", "frames " + listed_frames(far),
                           "up to " + percent(farthest) + " of the scan is no part of the person",
                           "it does not count; look for a second person or wrong calibration"});
    }
    if (used_.empty()) {
      throw DataError(
          "", "keypoints",
          "no frame that shows a person" + (unit.code.empty() ? "" : "; " + to_string(unit)),
          "at least one frame with hips, shoulders and limbs");
    }
    if (static_cast<int>(used_.size()) < kFewFrames) {
      findings_.push_back({Severity::Warning, "frames-few", "person",
                           std::to_string(used_.size()) + " frames",
                           "three and more tell shape from pose better"});
    }
    any_scan_ = std::any_of(scans_.begin(), scans_.end(),
                            [](const ScanPoints* scan) { return scan != nullptr; });
    if (!model_.shape.empty()) {
      if (!any_scan_) {
        // Keypoints show lengths. Mass at given girths moves no joint and may be anything in its
        // range; yet it moves a heel by a millimetre, where the detector is off by centimetres in
        // all frames alike: that would make sticks of shins and forearms.
        thickness_ = thickness_change(model_) / (kThicknessSpread * kThicknessSpread);
      }
      solve(rough, kKeypointIterations);
      FrameWeights fine = options_.weights;
      if (!any_scan_) {
        // Detectors are off by centimetres where joints truly are. With scans that does not matter;
        // alone they would bend the lengths to it: so they are as noisy as the rough fit leaves
        // them.
        fine.keypoint = std::max(fine.keypoint, keypoint_error(person_));
      }
      solve(fine, kKeypointIterations);
    }
    if (!any_scan_) {
      findings_.push_back({Severity::Warning, "no-scans", "person",
                           "there are no scans: the shape comes from keypoints alone",
                           "bone lengths are the person's; girths and mass are those usual at "
                           "the stature; images with masks give scans (atelier masks)"});
    }
  }

  void solve(const FrameWeights& weights, int iterations) {
    std::vector<const FrameTargets*> targets;
    for (const FrameTargets& one : targets_) {
      targets.push_back(&one);
    }
    const ShapeSolution found = solve_shape(person_, targets, x_, weights, iterations, thickness_);
    x_ = found.x;
    shape_ = found.shape;
    for (Index s = 0; s < shape_.size(); ++s) {
      const ShapeParameter& parameter = model_.shape[static_cast<std::size_t>(s)];
      const double range = parameter.max - parameter.min;
      const double room = s < own_shapes_ ? 0.5 * range : kBoneRoom * range;
      shape_[s] = std::clamp(shape_[s], parameter.min - room, parameter.max + room);
    }
    person_ = with_shape(person_, shape_);
  }

  void match(const FittedPerson& person, int round, Index samples) {
    const BodySurface rest = rest_surface(person);
    parallel_for(static_cast<Index>(used_.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const auto u = static_cast<std::size_t>(i);
        targets_[u].matches = scans_[u] == nullptr
                                  ? std::vector<SurfaceMatch>{}
                                  : match_scan(person, posed_surface(person, rest, x_[u]),
                                               sampled(*scans_[u], samples, round), input_.region);
      }
    });
  }

  void fit_shape() {
    if (!any_scan_) {
      return;
    }
    for (int round = 0; round < options_.shape_rounds; ++round) {
      match(person_, round, options_.samples);
      if (model_.shape.empty()) {
        pose_only(person_);
      } else {
        solve(options_.weights, kRoundIterations);
      }
    }
  }

  /// Poses alone, the person as it is.
  void pose_only(const FittedPerson& person) {
    parallel_for(static_cast<Index>(used_.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const auto u = static_cast<std::size_t>(i);
        x_[u] = solve_window(person, {{&targets_[u]}, {0}, {x_[u]}}, options_.weights, {},
                             kRoundIterations)
                    .x[0];
      }
    });
  }

  void displace(PersonalBody& person) {
    const Index vertices = vertex_count(person.model);
    const Points plain = person.model.mesh.vertices;
    const Points normals = vertex_normals(plain, person.model.mesh.faces);
    Eigen::VectorXd along = Eigen::VectorXd::Zero(vertices);
    prepare_smoothing(plain);
    for (int round = 0; round < options_.surface_rounds && any_scan_; ++round) {
      const FittedPerson displaced = fitted_person(person.model, input_.keypoint_names);
      match(displaced, round, options_.samples);
      pose_only(displaced);
      const Field field = measured(displaced);
      // Distances are from the surface as it is now.
      Eigen::VectorXd wanted = field.sum;
      for (Index v = 0; v < vertices; ++v) {
        wanted[v] += field.weight[v] * along[v];
      }
      along = smoothed(wanted, field.weight);
      person.support = field.support;
      for (Index v = 0; v < vertices; ++v) {
        person.displacements.row(v) = along[v] * normals.row(v);
      }
      person.model.mesh.vertices = plain + person.displacements;
    }
    if (any_scan_) {
      const FittedPerson displaced = fitted_person(person.model, input_.keypoint_names);
      match(displaced, 0, options_.samples);
      pose_only(displaced);
      match(displaced, 0, options_.samples);
    }
  }

  /// Distances of all scans from the person, at the vertices.
  Field measured(const FittedPerson& person) const {
    const Index vertices = vertex_count(*person.model);
    const BodySurface rest = rest_surface(person);
    std::vector<Field> of_frame(used_.size());
    parallel_for(static_cast<Index>(used_.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const auto u = static_cast<std::size_t>(i);
        Field& field = of_frame[u];
        field.sum = Eigen::VectorXd::Zero(vertices);
        field.weight = Eigen::VectorXd::Zero(vertices);
        if (scans_[u] == nullptr) {
          continue;
        }
        const BodySurface surface = posed_surface(person, rest, x_[u]);
        const std::vector<SurfaceMatch> matches =
            match_scan(person, surface, *scans_[u], input_.region, {0.04, 0.5});
        for (const SurfaceMatch& one : matches) {
          if (one.cloth) {
            continue;
          }
          Eigen::Vector3d at = Eigen::Vector3d::Zero();
          for (int c = 0; c < 3; ++c) {
            at += one.barycentric[c] *
                  surface.vertices.row(one.vertices[static_cast<std::size_t>(c)]).transpose();
          }
          const double gap = one.normal.dot(one.target - at);
          const double share = kOutlier * kOutlier / (kOutlier * kOutlier + gap * gap);
          for (int c = 0; c < 3; ++c) {
            const int v = one.vertices[static_cast<std::size_t>(c)];
            const double weight = share * share * one.barycentric[c];
            field.sum[v] += weight * gap;
            field.weight[v] += weight;
          }
        }
      }
    });
    Field all{Eigen::VectorXd::Zero(vertices), Eigen::VectorXd::Zero(vertices),
              Eigen::VectorXd::Zero(vertices)};
    for (const Field& one : of_frame) {
      for (Index v = 0; v < vertices; ++v) {
        if (one.weight[v] > 0) {
          // A frame counts once, however dense its scan: its points share its pose's error.
          const double count = std::min(1.0, one.weight[v]);
          all.sum[v] += count * one.sum[v] / one.weight[v];
          all.weight[v] += count;
          all.support[v] += one.weight[v] > 0.1 ? 1 : 0;
        }
      }
    }
    return all;
  }

  void prepare_smoothing(const Points& rest) {
    laplacian_ = cotangent_laplacian(rest, model_.mesh.faces, {.skip_degenerate = true});
    patch_ = vertex_areas(rest, model_.mesh.faces).mean();
    mirror_ = mirror_vertices(rest);
  }

  /// The field that is near to what was measured, smooth, small, and like the other side where
  /// nothing was: sparse least squares with one factorisation.
  Eigen::VectorXd smoothed(const Eigen::VectorXd& wanted, const Eigen::VectorXd& weight) const {
    const Index count = weight.size();
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    const double noise2 = options_.surface_noise * options_.surface_noise;
    const auto difference = [&](Index a, Index b, double w) {
      entries.emplace_back(a, a, w);
      entries.emplace_back(b, b, w);
      entries.emplace_back(a, b, -w);
      entries.emplace_back(b, a, -w);
    };
    for (Index v = 0; v < count; ++v) {
      entries.emplace_back(
          v, v, weight[v] / noise2 + 1e-2 / (options_.displacement * options_.displacement));
      right[v] = wanted[v] / noise2;
      const auto i = static_cast<std::size_t>(v);
      if (mirror_[i] >= 0 && mirror_[i] != v && weight[v] < 0.5) {
        difference(v, mirror_[i], 1 / (kMirrorNoise * kMirrorNoise));
      }
    }
    Eigen::SparseMatrix<double> matrix(count, count);
    matrix.setFromTriplets(entries.begin(), entries.end());
    // Membrane energy: noise within `smoothness` is averaged out where one frame saw the surface.
    matrix += options_.smoothness * options_.smoothness / (noise2 * patch_) * laplacian_;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
    ATELIER_CHECK(factor.info() == Eigen::Success, "a positive definite matrix");
    return factor.solve(right);
  }

  Personalization finished(PersonalBody person) {
    Personalization result;
    double squares = 0;
    double share = 0;
    const FittedPerson fitted = fitted_person(person.model, input_.keypoint_names);
    for (std::size_t u = 0; u < used_.size(); ++u) {
      std::vector<SurfaceMatch> skin = targets_[u].matches;
      std::erase_if(skin, [](const SurfaceMatch& one) { return one.cloth; });
      const MatchError error = match_error(
          skin_vertices(person.model, fitted.shaped, pose_of_variables(fitted, x_[u])), skin);
      squares += error.rms * error.rms * error.share;
      share += error.share;
    }
    result.scan_rms = share > 0 ? std::sqrt(squares / share) : 0;
    result.keypoint_rms = keypoint_error(fitted);
    const Eigen::VectorXd areas = vertex_areas(person.model.mesh.vertices, person.model.mesh.faces);
    std::map<std::string, double> unseen;  // area by joint
    double missing = 0;
    for (Index v = 0; v < areas.size(); ++v) {
      if (person.support[v] == 0) {
        Index slot = 0;
        person.model.skin.weights.row(v).maxCoeff(&slot);
        const int joint = person.model.skin.joints(v, slot);
        unseen[person.model.skeleton.names[static_cast<std::size_t>(joint)]] += areas[v];
        missing += areas[v];
      }
    }
    result.unseen = missing / areas.sum();
    if (any_scan_ && result.unseen > kUnseenWorth) {
      std::vector<std::pair<double, std::string>> worst;
      worst.reserve(unseen.size());
      for (const auto& [name, area] : unseen) {
        worst.emplace_back(-area, name);
      }
      std::sort(worst.begin(), worst.end());
      std::string names;
      for (std::size_t i = 0; i < std::min<std::size_t>(5, worst.size()); ++i) {
        names += (i > 0 ? ", " : "") + worst[i].second;
      }
      findings_.push_back(
          {Severity::Warning, "surface-unseen", "person",
           percent(result.unseen) + " of the skin was never seen bare, most of it at " + names,
           "its shape there follows the parts around it and the other side of the "
           "body; frames that show it bare improve it"});
    }
    check_personal_body(person);
    const std::optional<BodyMeasurements> usual = measures_of(model_);
    const std::optional<BodyMeasurements> measured = measures_of(person.model);
    if (usual && measured) {
      for (Finding& finding : implausible(*measured, *usual)) {
        findings_.push_back(std::move(finding));
      }
    }
    result.person = std::move(person);
    result.poses = x_;
    result.findings = findings_;
    return result;
  }

  double keypoint_error(const FittedPerson& person) const {
    double sum = 0;
    int count = 0;
    RidingMarkers riding = person.places.riding;
    std::replace(riding.joints.begin(), riding.joints.end(), -1, 0);
    for (std::size_t u = 0; u < used_.size(); ++u) {
      const Points at = marker_positions(
          riding, forward_kinematics(person.shaped.skeleton, pose_of_variables(person, x_[u])));
      for (Index k = 0; k < targets_[u].keypoints.rows(); ++k) {
        if (targets_[u].deviations[k] > 0 &&
            person.places.riding.joints[static_cast<std::size_t>(k)] >= 0) {
          sum += (at.row(k) - targets_[u].keypoints.row(k)).squaredNorm();
          ++count;
        }
      }
    }
    return count > 0 ? std::sqrt(sum / count) : 0;
  }

  BodyModel model_;   // with the bones' lengths among its shapes
  Index own_shapes_;  // before them
  const TrackInput& input_;
  const PersonalizeOptions& options_;
  FittedPerson person_;
  Eigen::VectorXd shape_;
  std::vector<double> times_;
  std::vector<std::size_t> used_;         // frames that count
  std::vector<const ScanPoints*> scans_;  // of those; null: none that can be used
  std::vector<FrameTargets> targets_;
  std::vector<Eigen::VectorXd> x_;
  bool any_scan_ = false;
  Eigen::MatrixXd thickness_;  // [S,S] that holds girths where no scan shows them; or empty
  Eigen::SparseMatrix<double> laplacian_;
  double patch_ = 0;  // m2 of a vertex, mean
  std::vector<int> mirror_;
  std::vector<Finding> findings_;
};

}  // namespace

OptionTable describe(PersonalizeOptions& options) {
  OptionTable table;
  table.add("weights", describe(options.weights));
  table.add("samples", options.samples, 0, 1e7, "",
            "Number of points of each scan in an iteration; 0: all");
  table.add("bone_lengths", options.bone_lengths, 0, 1, "",
            "Standard deviation of a bone's length relative to that of the shape; 0: bones keep "
            "the length of the shape");
  table.add("shape_rounds", options.shape_rounds, 1, 100, "",
            "Number of ICP rounds while the shape is estimated");
  table.add("surface_rounds", options.surface_rounds, 0, 100, "",
            "Number of ICP rounds while the surface is displaced; 0: no displacement");
  table.add("surface_noise", options.surface_noise, 1e-5, 0.1, "m",
            "Standard deviation of a scan's noise; larger smooths more");
  table.add("smoothness", options.smoothness, 1e-3, 1, "m",
            "Length over which displacements are smooth; larger smooths more");
  table.add("displacement", options.displacement, 1e-4, 0.2, "m",
            "Standard deviation of displacements off the shape space");
  return table;
}

std::vector<int> mirror_vertices(const Points& rest) {
  Points other = rest;
  other.col(0) *= -1;
  std::vector<int> mirror;
  for (const ClosestPoint& near : closest_points(build_point_tree(rest), other, kMirrorReach)) {
    mirror.push_back(near.face);
  }
  return mirror;
}

Personalization personalize(const BodyModel& model, const TrackInput& input,
                            const PersonalizeOptions& options) {
  ATELIER_CHECK(
      input.frames.size() == input.frame_ids.size() && !input.frames.empty() && input.fps > 0,
      "frames with numbers and a rate");
  for (const TrackFrame& frame : input.frames) {
    ATELIER_CHECK(frame.keypoints.rows() == frame.deviations.size(), "keypoints by name");
  }
  return Personalizer(model, input, options).run();
}

}  // namespace atelier
