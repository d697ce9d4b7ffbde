#include "pipeline/synthesis/performance.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/text_writer.h"
#include "core/saturating_cast.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr double kHold = 0.25;         // s for the cloth to calm down there
constexpr double kLead = 1.0;          // s of motion that is simulated before the first frame
constexpr double kRamp = 0.5;          // s in which a motion that is entered midway gains its speed
constexpr double kMinimalSeconds = 4;  // the minimal sequence is spread over its whole motion

/// Everything but cloth at one pose.
PerformedFrame posed(const Performance& performance, const SynthesisOptions& options,
                     const Pose& simulated, const SoftTissue& flesh, const Points& skinned,
                     bool clothed) {
  PerformedFrame frame;
  const BodyModel& model = performance.subject.model;
  const Eigen::Vector3d shift = clothed ? performance.shift : Eigen::Vector3d::Zero();
  Pose pose = simulated;
  pose.root_translation += shift;
  frame.truth.pose = pose;
  frame.truth.joints = forward_kinematics(model.skeleton, pose).positions;
  frame.truth.keypoints = posed_points(model, performance.keypoints.places, pose);
  frame.truth.body =
      with_soft_tissue(performance.subject, skinned, flesh,
                       options.subject.subject == "real" ? options.subject.soft_tissue : 0)
          .rowwise() +
      shift.transpose();
  for (const WornLayer& layer : performance.layers) {
    frame.truth.layers.push_back(clothed || layer.in_minimal ? skin_vertices(layer.model, pose)
                                                             : Points(0, 3));
  }
  frame.truth.garments.resize(performance.outfit.garments.size(), Points(0, 3));
  return frame;
}

/// Velocities by the difference to a frame `seconds` earlier.
void add_velocities(PerformedFrame& frame, const PerformedFrame& before, double seconds) {
  const auto difference = [&](const Points& now, const Points& then) {
    return now.rows() == then.rows() ? Points((now - then) / seconds)
                                     : Points(Points::Zero(now.rows(), 3));
  };
  frame.body_velocity = difference(frame.truth.body, before.truth.body);
  for (std::size_t i = 0; i < frame.truth.layers.size(); ++i) {
    frame.layer_velocities.push_back(difference(frame.truth.layers[i], before.truth.layers[i]));
  }
  for (std::size_t i = 0; i < frame.truth.garments.size(); ++i) {
    frame.garment_velocities.push_back(
        difference(frame.truth.garments[i], before.truth.garments[i]));
  }
}

/// Simulated frames a second: a whole number of them between two frames of the capture.
double simulation_rate(const SynthesisOptions& options) {
  return options.fps * std::ceil(options.outfit.rate / options.fps - 1e-9);
}

/// Steps of the simulation, each `1 / rate` seconds: first the transition, then the motion, of
/// which what lies more than `kLead` before the first frame is left out.
struct Timeline {
  const Performance& performance;
  double step_seconds;
  Pose rest;
  double transition = 0;  ///< s from the rest pose to where the motion begins

  Timeline(const Performance& performance_, double step_seconds_)
      : performance(performance_),
        step_seconds(step_seconds_),
        rest(rest_pose(performance_.subject.model.skeleton)) {
    transition = transition_seconds(performance.subject.model.skeleton, rest,
                                    performance.clothed.pose(begin()));
  }

  /// Where in the motion it is entered.
  double begin() const { return std::max(0.0, performance.start - kLead); }
  /// Seconds since then that gaining speed costs.
  double delay() const { return begin() > 0 ? kRamp / 2 : 0; }
  double seconds(std::int64_t step) const {
    return static_cast<double>(step) * step_seconds - transition - kHold;
  }
  /// Place in the motion, `t` seconds after it was entered.
  double place(double t) const {
    t = std::max(t, 0.0);
    if (begin() <= 0) {
      return t;
    }
    return begin() + (t < kRamp ? t * t / (2 * kRamp) : t - kRamp / 2);
  }
  Pose pose(std::int64_t step) const {
    const double t = seconds(step);
    const Pose first = performance.clothed.pose(place(t));
    const double share = eased((t + transition + kHold) / transition);
    return share < 1 ? blended(rest, first, share) : first;
  }
  /// The step whose end is the i-th frame of the sequence.
  std::int64_t step_of(int frame, double fps) const {
    const double after = performance.start - begin() + delay() + frame / fps;
    return saturating_cast<std::int64_t>(std::round((transition + kHold + after) / step_seconds));
  }
};

/// Throws where cloth is torn apart, as when limbs pinch it or a motion leaps.
void check_simulated(const FrameReport& report, double seconds, int frame_id) {
  constexpr double kTorn = 0.5;  // of an edge's length: no cloth stretches like that
  if (!(report.strain_p95 < kTorn)) {
    char found[120];
    std::snprintf(found, sizeof(found), "cloth stretched by %.0f%% at %.2f s of the motion",
                  100 * report.strain_p95, seconds);
    throw DataError("simulation", "frame " + std::to_string(frame_id), found,
                    "a motion that cloth follows: another --motion or --start, a slower one, or "
                    "more --substeps");
  }
}

ContinuousMotion clothed_motion(const BodyModel& body, const SynthesisOptions& options) {
  ContinuousMotion motion =
      continuous_motion(body, motion_of(options), options.motion.duration, kSoleHeight);
  if (options.motion.start > motion.duration) {
    throw UnknownValue(motion_of(options), "start", number_text(options.motion.start),
                       "at most its " + number_text(motion.duration) + " s");
  }
  return motion;
}

}  // namespace

std::string motion_of(const SynthesisOptions& options) {
  if (options.motion.motion != "auto") {
    return options.motion.motion;
  }
  const std::string& garment = options.outfit.garment;
  const bool flies =
      garment.find("dress") != std::string::npos || garment.find("skirt") != std::string::npos;
  return flies ? "spin" : "stride";
}

std::vector<Finding> require_cast(const SynthesisOptions& options) {
  const BodyModel body =
      make_subject(options.subject, static_cast<std::uint64_t>(options.seed)).model;
  require_garments(body, options.outfit, options.subject.body);
  return clothed_motion(body, options).findings;
}

Performance cast_performance(const SynthesisOptions& options,
                             const std::vector<GroundTruthGarment>& dressed) {
  Performance performance;
  const auto seed = static_cast<std::uint64_t>(options.seed);
  performance.subject = make_subject(options.subject, seed);
  const BodyModel& body = performance.subject.model;
  performance.keypoints = subject_keypoints(body);
  performance.layers.push_back(hair_cap(body, seed));
  performance.layers.push_back(plain_shoes(body, seed));
  performance.minimal = continuous_motion(body, "range", kMinimalSeconds, 0);
  if (options.frames > 0) {
    const double taken = (options.frames - 1) / options.fps;
    performance.clothed = clothed_motion(body, options);
    OutfitOptions outfit = options.outfit;
    outfit.rate = simulation_rate(options);
    performance.outfit = dressed.empty() ? dress_body(body, outfit, options.subject.body)
                                         : dressed_before(dressed, outfit);
    performance.start = options.motion.start >= 0
                            ? options.motion.start
                            : std::max(0.0, (performance.clothed.duration - taken) / 2);
    if (!is_procedural(motion_of(options))) {
      performance.clothed =
          facing_as_at_rest(body, performance.clothed, std::max(0.0, performance.start - kLead));
      performance.shift = -performance.clothed.pose(performance.start + taken / 2).root_translation;
      performance.shift.y() = 0;
    }
  }
  return performance;
}

GroundTruth truth_of(const Performance& performance, const SynthesisOptions& options) {
  GroundTruth truth;
  const BodyModel& model = performance.subject.model;
  truth.skeleton = model.skeleton;
  truth.shape_names = performance.subject.shape_names;
  truth.shape = performance.subject.shape;
  truth.body = model.mesh;
  truth.skin_joints = model.skin.joints;
  truth.skin_weights = model.skin.weights;
  for (const WornLayer& layer : performance.layers) {
    truth.layers.push_back(layer.model.mesh);
    truth.layer_names.push_back(layer.name);
  }
  truth.garments = performance.outfit.garments;
  truth.keypoint_names = performance.keypoints.names;
  truth.numbers = {{"displacement_rms", performance.subject.displacement_rms},
                   {"soft_tissue", options.subject.soft_tissue},
                   {"weight_jitter", options.subject.weight_jitter},
                   {"simulation_rate", simulation_rate(options)},
                   {"simulation_substeps", static_cast<double>(options.outfit.substeps)},
                   {"contact_thickness", performance.outfit.solver.thickness},
                   {"exposure", options.sensor.exposure},
                   {"seed", static_cast<double>(options.seed)}};
  truth.texts = {{"subject", performance.subject.description},
                 {"subject_kind", options.subject.subject},
                 {"garment", options.outfit.garment},
                 {"motion", motion_of(options)}};
  return truth;
}

void perform_minimal(const Performance& performance, const SynthesisOptions& options,
                     const std::function<void(int, const PerformedFrame&)>& take) {
  const BodyModel& model = performance.subject.model;
  const ShapedBody body = shape_body(model);
  const double step = 1 / options.outfit.rate;
  const double spacing = kMinimalSeconds / options.minimal_frames;
  SoftTissue flesh;
  PerformedFrame before;
  std::int64_t next = 0;
  for (int i = 0; i < options.minimal_frames; ++i) {
    const auto last = saturating_cast<std::int64_t>(std::round((i + 0.5) * spacing / step));
    for (; next <= last; ++next) {
      const Pose pose = performance.minimal.pose(static_cast<double>(next) * step);
      const Points skinned = skin_vertices(model, body, pose);
      flesh = soft_tissue_step(std::move(flesh), skinned, step);
      if (next + 1 < last) {
        continue;
      }
      PerformedFrame frame = posed(performance, options, pose, flesh, skinned, false);
      if (next == last) {
        add_velocities(frame, before, step);
        take(i, frame);
      }
      before = std::move(frame);
    }
  }
}

void perform_clothed(
    const Performance& performance, const SynthesisOptions& options, const PerformanceState* from,
    const std::function<void(int, const PerformedFrame&, const PerformanceState&)>& take) {
  const BodyModel& model = performance.subject.model;
  const Outfit& outfit = performance.outfit;
  const ShapedBody body = shape_body(model);
  const double step_seconds = 1 / simulation_rate(options);
  const Timeline timeline(performance, step_seconds);
  PerformanceState state;
  if (from != nullptr) {
    state = *from;
  } else {
    state.cloth = outfit.state;
  }
  const std::unique_ptr<Solver> solver =
      create_solver({outfit.cloth, model.mesh.faces}, outfit.solver);
  solver->set_state(state.cloth);
  const auto body_at = [&](const Pose& pose, const SoftTissue& flesh, const Points& skinned) {
    return posed(performance, options, pose, flesh, skinned, true);
  };
  const auto with_cloth = [&](PerformedFrame frame, const Points& cloth) {
    for (std::size_t g = 0; g < outfit.garments.size(); ++g) {
      frame.truth.garments[g] =
          cloth.middleRows(outfit.first[g], outfit.first[g + 1] - outfit.first[g]).rowwise() +
          performance.shift.transpose();
    }
    return frame;
  };
  const double amplitude = options.subject.subject == "real" ? options.subject.soft_tissue : 0;
  Points last_body;
  if (state.step == 0) {
    last_body = model.mesh.vertices;
  } else {
    last_body = with_soft_tissue(performance.subject, state.flesh.last, state.flesh, amplitude);
  }
  // The step that leads to a frame is looked at from both ends, for its velocities.
  while (state.next_frame < options.frames) {
    const std::int64_t last = timeline.step_of(state.next_frame, options.fps);
    PerformedFrame before;
    while (state.step < last) {
      const Pose pose = timeline.pose(state.step + 1);
      const Points skinned = skin_vertices(model, body, pose);
      if (state.step + 1 == last) {
        before = with_cloth(posed(performance, options, timeline.pose(state.step), state.flesh,
                                  state.step == 0 ? model.mesh.vertices : state.flesh.last, true),
                            solver->state().positions);
      }
      state.flesh = soft_tissue_step(std::move(state.flesh), skinned, step_seconds);
      Control control;
      control.body_start = last_body;
      control.body_end = with_soft_tissue(performance.subject, skinned, state.flesh, amplitude);
      check_simulated(solver->step(control), timeline.place(timeline.seconds(state.step + 1)),
                      state.next_frame);
      last_body = control.body_end;
      ++state.step;
      if (state.step == last) {
        state.cloth = solver->state();
        PerformedFrame frame =
            with_cloth(body_at(pose, state.flesh, skinned), state.cloth.positions);
        add_velocities(frame, before, step_seconds);
        const int taken = state.next_frame++;
        take(taken, frame, state);
      }
    }
    ATELIER_CHECK(state.next_frame == options.frames ||
                      timeline.step_of(state.next_frame, options.fps) > state.step,
                  "frames follow quicker than the simulation's steps");
  }
}

}  // namespace atelier
