#include "pipeline/outfit/fitting.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/measure.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "core/tree.h"
#include "pipeline/outfit/tailor.h"

namespace atelier {
namespace {

// Of SMPL's mean woman, from her origin (our reading of where the patterns' sleeves and waists
// lie).
constexpr double kSmplShoulders = 0.21;      // m up to the shoulder joints
constexpr double kSmplHips = -0.32;          // m down to the hip joints
constexpr double kSmplArmpits = 0.12;        // m; what reaches above it hangs on the shoulders
constexpr double kSmplTrunkMiddle = 0.0165;  // m, half way between the patterns' fronts and backs
constexpr double kSmplCrown = 0.7;           // m; no pattern round her reaches so high
// Of GarmentCode's mean body, from the ground below it (mean_all.yaml: height, head_l, waist_line,
// hips_line, armscye_depth; the shoulder joints by their height in SMPL).
constexpr double kStandingShoulders = 1.40;     // m
constexpr double kStandingHips = 0.853;         // m
constexpr double kStandingArmpits = 1.28;       // m
constexpr double kStandingTrunkMiddle = 0.025;  // m, as of SMPL's
constexpr double kSinking = 0.02;               // m that cloth sinks while it is sewn
constexpr double kHemRidesUp = 0.15;     // m; what ends less below the hips can stay above them
constexpr double kEase = 0.03;           // m of girth: cloth keeps off the skin, and breath
constexpr double kMinShareOfMass = 0.7;  // of the average, of a person who is not ill

/// First and one past the last vertex of every panel: vertices of a panel are consecutive.
std::vector<std::pair<Index, Index>> panel_ranges(const Garment& panels) {
  std::vector<std::pair<Index, Index>> ranges(panels.panel_names.size(),
                                              {panels.mesh.vertices.rows(), 0});
  for (Index f = 0; f < panels.mesh.faces.rows(); ++f) {
    auto& [begin, end] =
        ranges[static_cast<std::size_t>(panels.panels[static_cast<std::size_t>(f)])];
    begin = std::min<Index>(begin, panels.mesh.faces.row(f).minCoeff());
    end = std::max<Index>(end, panels.mesh.faces.row(f).maxCoeff() + 1);
  }
  return ranges;
}

/// Length that a horizontal plane cuts out of the panels that lie before and behind the trunk.
double girth_of_panels(const Garment& panels, double height, double half_width) {
  const auto ranges = panel_ranges(panels);
  const Points& x = panels.mesh.vertices;
  double girth = 0;
  for (Index f = 0; f < panels.mesh.faces.rows(); ++f) {
    const auto [begin, end] =
        ranges[static_cast<std::size_t>(panels.panels[static_cast<std::size_t>(f)])];
    if (x.col(0).segment(begin, end - begin).cwiseAbs().minCoeff() > half_width &&
        x.col(1).segment(begin, end - begin).minCoeff() > height - 0.05) {
      continue;  // a sleeve: beside the body, and it ends near the armpit
    }
    std::vector<Eigen::RowVector3d> cut;
    for (int c = 0; c < 3; ++c) {
      const Eigen::RowVector3d a = x.row(panels.mesh.faces(f, c));
      const Eigen::RowVector3d b = x.row(panels.mesh.faces(f, (c + 1) % 3));
      if ((a.y() < height) != (b.y() < height)) {
        cut.push_back(a + (height - a.y()) / (b.y() - a.y()) * (b - a));
      }
    }
    if (cut.size() == 2) {
      girth += (cut[1] - cut[0]).norm();
    }
  }
  return girth;
}

/// The same near a height: panels that are sewn together lie apart before.
double girth_near(const Garment& panels, double height, double half_width) {
  for (const double reach : {0.0, 0.02, 0.05, 0.08}) {
    double girth = 0;
    for (int step = -4; step <= 4; ++step) {
      girth = std::max(girth, girth_of_panels(panels, height + reach * step / 4, half_width));
    }
    if (girth > 0.4) {
      return girth;
    }
  }
  return 0;
}

/// Of a loop through several unsewn panels. Its points are evenly spaced, and the way from one
/// panel to the next counts as one step of those within them.
double opening_length(const Garment& panels, const std::vector<int>& loop) {
  double length = 0;
  int steps = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const int next = loop[(i + 1) % loop.size()];
    if (std::abs(loop[i] - next) == 1) {
      length += (panels.mesh.vertices.row(loop[i]) - panels.mesh.vertices.row(next)).norm();
      ++steps;
    }
  }
  return steps > 0 ? length * static_cast<double>(loop.size()) / steps : 0;
}

/// Sewing threads that a body is in the way of.
Index blocked_threads(const Garment& panels, const TriangleTree& body, double lift) {
  std::vector<Ray> threads;
  const Eigen::Vector3d up(0, lift, 0);
  for (const Seam& seam : panels.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      const Eigen::Vector3d a = panels.mesh.vertices.row(seam.a[i]).transpose() + up;
      const Eigen::Vector3d b = panels.mesh.vertices.row(seam.b[i]).transpose() + up;
      if ((b - a).norm() > 1e-6) {
        threads.push_back({a, b - a, 0, 1});
      }
    }
  }
  const std::vector<char> hits = any_hits(body, threads);
  return std::count(hits.begin(), hits.end(), 1);
}

/// The least lift, to 15 cm, that leaves the fewest threads behind the body: shoulder seams must
/// close over the shoulders, not below them. A little more where that costs none, since cloth sinks
/// while it is sewn.
double lift_over_shoulders(const Garment& panels, const Mesh& body) {
  const TriangleTree tree = build_tree(body.vertices, body.faces);
  double best = 0;
  Index fewest = blocked_threads(panels, tree, 0);
  for (int step = 1; step <= 15 && fewest > 0; ++step) {
    const Index blocked = blocked_threads(panels, tree, 0.01 * step);
    if (blocked < fewest) {
      fewest = blocked;
      best = 0.01 * step;
    }
  }
  return blocked_threads(panels, tree, best + kSinking) <= fewest ? best + kSinking : best;
}

}  // namespace

Pose arms_out_pose(const BodyModel& body) {
  const Humanoid person = recognised_humanoid(body.skeleton);
  Pose pose = rest_pose(body.skeleton);
  for (std::size_t side = 0; side < 2; ++side) {
    const Arm& arm = person.arms[side];
    // Upper arm first, then the forearm on it; each turns its bone into the line of the shoulders.
    for (const auto& [joint, end] :
         {std::pair(arm.shoulder, arm.elbow), std::pair(arm.elbow, arm.wrist)}) {
      const JointFrames frames = forward_kinematics(body.skeleton, pose);
      const Eigen::Vector3d bone =
          (frames.positions.row(end) - frames.positions.row(joint)).transpose();
      const Eigen::Vector3d out = Eigen::Vector3d::UnitX() * (side == 0 ? 1 : -1);
      const Eigen::Matrix3d& world = frames.rotations[static_cast<std::size_t>(joint)];
      pose.rotations.row(joint) =
          rotation_vector(world.transpose() * rotation_between(bone, out) * world).transpose();
    }
  }
  return pose;
}

void move_off_ground(SewingPattern& pattern) {
  double top = -std::numeric_limits<double>::infinity();
  for (const Panel& panel : pattern.panels) {
    for (Index i = 0; i < panel.corners.rows(); ++i) {
      top = std::max(top, place(panel.placement, panel.corners.row(i).transpose()).y());
    }
  }
  if (!(top > kSmplCrown)) {
    return;
  }
  const double down =
      top > kStandingArmpits ? kStandingShoulders - kSmplShoulders : kStandingHips - kSmplHips;
  for (Panel& panel : pattern.panels) {
    panel.placement.origin -= Eigen::Vector3d(0, down, kStandingTrunkMiddle - kSmplTrunkMiddle);
  }
}

bool reaches_shoulders(const Garment& panels) {
  return panels.mesh.vertices.col(1).maxCoeff() > kSmplArmpits;
}

void place_round_body(Garment& panels, const BodyModel& body, const Points& posed) {
  const TailorMeasures measures = tailor_measures(body);
  const double shoulders = (measures.left_shoulder.y() + measures.right_shoulder.y()) / 2;
  double front = -1e9;
  double back = 1e9;
  for (Index v = 0; v < posed.rows(); ++v) {
    const bool trunk = std::abs(posed(v, 0)) < std::abs(measures.left_shoulder.x()) &&
                       posed(v, 1) > measures.hip.y() && posed(v, 1) < shoulders;
    if (trunk) {
      front = std::max(front, posed(v, 2));
      back = std::min(back, posed(v, 2));
    }
  }
  const Eigen::RowVector3d shift(
      measures.hip.x(),
      reaches_shoulders(panels) ? shoulders - kSmplShoulders : measures.hip.y() - kSmplHips,
      (front + back) / 2 - kSmplTrunkMiddle);
  const bool upper = reaches_shoulders(panels);
  panels.mesh.vertices.rowwise() += shift;
  if (upper) {
    Mesh mesh = body.mesh;
    mesh.vertices = posed;
    panels.mesh.vertices.col(1).array() += lift_over_shoulders(panels, mesh);
  }
}

std::vector<GirthFit> girth_fits(const Garment& panels, const BodyModel& body) {
  const TailorMeasures measures = tailor_measures(body);
  const double pelvis =
      measures.waist.y() - 0.33 * (measures.neck_base.y() - measures.waist.y()) / 0.67;
  const double chest = pelvis + 0.63 * (measures.neck_base.y() - pelvis);
  const double half_width = 0.9 * std::abs(measures.left_shoulder.x());
  std::vector<GirthFit> fits;
  const auto compare = [&](const char* name, double garment, double on_body) {
    if (garment > 0) {
      fits.push_back({name, garment, on_body});
    }
  };
  const double top = panels.mesh.vertices.col(1).maxCoeff();
  if (top > chest) {
    compare("chest_girth", girth_near(panels, chest, half_width), measures.chest_girth);
    compare("waist_girth", girth_near(panels, measures.waist.y(), half_width),
            measures.waist_girth);
  } else {
    double highest = -1e9;
    double length = 0;
    for (const std::vector<int>& loop : panels.boundaries) {
      double y = 0;
      for (const int v : loop) {
        y += panels.mesh.vertices(v, 1) / static_cast<double>(loop.size());
      }
      if (y > highest) {
        highest = y;
        length = opening_length(panels, loop);
      }
    }
    compare("waist_girth", length, measures.waist_girth);
  }
  if (panels.mesh.vertices.col(1).minCoeff() < measures.hip.y() - kHemRidesUp) {
    // A skirt below a bodice lies lower than it will hang.
    double widest = 0;
    for (const double lower : {0.0, 0.03, 0.06, 0.09}) {
      widest = std::max(widest, girth_of_panels(panels, measures.hip.y() - lower, half_width));
    }
    compare("hip_girth", widest, measures.hip_girth);
  }
  return fits;
}

std::string what_is_tight(const std::vector<GirthFit>& fits) {
  std::string tight;
  for (const GirthFit& fit : fits) {
    if (fit.body > kGirthGive * fit.garment) {
      char text[120];
      std::snprintf(text, sizeof text, "%s%s of %.2f m on a body of %.2f m",
                    tight.empty() ? "" : ", ", fit.measure.c_str(), fit.garment, fit.body);
      tight += text;
    }
  }
  return tight;
}

DefaultHumanOptions human_that_fits(const std::vector<GirthFit>& fits,
                                    const DefaultHumanOptions& human) {
  DefaultHumanOptions fitting = human;
  const double start = expected_measures(human).mass;
  for (double mass = start; mass >= kMinShareOfMass * start; mass -= 1) {
    fitting.mass = mass;
    const BodyMeasurements measures = expected_measures(fitting);
    const bool fit = std::all_of(fits.begin(), fits.end(), [&](const GirthFit& one) {
      const auto& names = measurement_names();
      const auto name =
          std::find_if(names.begin(), names.end(),
                       [&](const NamedMeasurement& known) { return known.name == one.measure; });
      return measures.*name->value + kEase <= one.garment;
    });
    if (fit) {
      return fitting;
    }
  }
  throw DataError("", "garment",
                  "too tight for any body of this stature (" + what_is_tight(fits) + ")",
                  "a larger garment (--pattern-scale) or a smaller --human.stature");
}

}  // namespace atelier
