// Prints what both simulators do to a dress whose armpits pinch it, as a table of
// docs/results/projective_friction.md: the default human of --seed stands for half a second, goes
// over to a stride and takes it, two seconds at 60 frames a second.
//
//   dress_in_stride [--seed N] [--edge-length M] [SOLVER:SUBSTEPS...]

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/moving_body.h"
#include "bodymodel/retarget/synthetic_motion.h"
#include "bodymodel/skinning.h"
#include "pipeline/outfit/dressing.h"
#include "pipeline/outfit/worn_cloth.h"
#include "pipeline/synthesis/synthetic_subject.h"
#include "simulation/contact/crossings.h"
#include "simulation/solver.h"

namespace atelier {
namespace {

constexpr double kRate = 60;       // simulated frames a second
constexpr double kStanding = 0.5;  // s

MovingBody striding(const BodyModel& model) {
  MovingBody body;
  body.model = model;
  body.shaped = shape_body(model);
  const Pose rest = rest_pose(model.skeleton);
  const double ground = skin_vertices(model, body.shaped, rest).col(1).minCoeff();
  const ContinuousMotion motion = continuous_motion(model, "stride", 2, ground);
  body.motion.fps = 30;
  for (int i = 0; i <= 60; ++i) {
    body.motion.poses.push_back(motion.pose(i / body.motion.fps));
    body.motion.frame_ids.push_back(i);
  }
  lead_in(body, rest, Points(), kStanding);
  return body;
}

/// A row of the table.
void print_course(const Outfit& outfit, const MovingBody& body, const std::string& solver_name,
                  int substeps) {
  SolverOptions options = worn_solver_options();
  options.name = solver_name;
  options.substeps = options.projective.substeps = substeps;
  options.time_step = 1 / kRate;
  options.thickness = outfit.solver.thickness;
  const auto solver = create_solver({outfit.cloth, body.model.mesh.faces}, options);
  solver->set_state(outfit.state);
  const int standing = static_cast<int>(kRate * kStanding);
  const int frames = static_cast<int>(std::ceil(kRate * lead_seconds(body))) + 120;
  const int at_start = count_crossings(outfit.state.positions, outfit.cloth.faces);
  int worst = 0;
  int last = 0;
  int inside = 0;
  double strain = 0;
  double deepest = 0;
  double fastest = 0;  // on a body that stands, after the first quarter of a second
  Points now = surface_at(body, 0);
  for (int i = 0; i < frames; ++i) {
    Control control;
    control.body_start = now;
    control.body_end = now = surface_at(body, (i + 1) / kRate);
    const FrameReport report = solver->step(control);
    const ClothState state = solver->state();
    last = count_crossings(state.positions, outfit.cloth.faces);
    worst = std::max(worst, last);
    inside = std::max(inside, report.penetrating);
    deepest = std::max(deepest, report.penetration_depth);
    strain = std::max(strain, report.strain_p95);
    if (i >= standing / 2 && i < standing) {
      fastest = std::max(fastest, state.velocities.rowwise().norm().maxCoeff());
    }
  }
  std::printf("| %s | %d | %.1f | %.1f | %d | %.1f | %d | %d | %d |\n", solver_name.c_str(),
              substeps, 100 * strain, fastest, inside, 1e3 * deepest, at_start, worst, last);
  std::fflush(stdout);
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  using namespace atelier;
  CLI::App app("A dress in a stride, by both simulators");
  std::uint64_t seed = 7;
  OutfitOptions outfit_options;
  outfit_options.edge_length = 0.022;
  outfit_options.substeps = 30;
  std::vector<std::string> courses{"projective-friction:5", "projective-friction:20", "xpbd:30"};
  app.add_option("--seed", seed, "Of the default human's measures");
  app.add_option("--edge-length", outfit_options.edge_length, "Of the dress, m");
  app.add_option("courses", courses, "SOLVER:SUBSTEPS");
  CLI11_PARSE(app, argc, argv);
  try {
    const SyntheticSubject subject = make_subject({}, seed);
    const Outfit outfit = dress_body(subject.model, outfit_options);
    const MovingBody body = striding(subject.model);
    std::printf("%s; %d vertices.\n\n", subject.description.c_str(),
                static_cast<int>(outfit.cloth.rest_positions.rows()));
    std::printf(
        "| solver | substeps | strain, p95 %% | fastest vertex while she stands m/s | vertices "
        "inside the body | deepest mm | crossings at the start | worst frame | at the end |\n"
        "|---|---|---|---|---|---|---|---|---|\n");
    for (const std::string& course : courses) {
      const std::size_t colon = course.find(':');
      print_course(outfit, body, course.substr(0, colon),
                   colon == std::string::npos ? 20 : std::stoi(course.substr(colon + 1)));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
