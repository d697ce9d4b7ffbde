#include "simulation/projective/projective.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/contact/exact_counts.h"
#include "simulation/projective/anderson_acceleration.h"
#include "simulation/projective/begun_report.h"
#include "simulation/projective/body_contacts.h"
#include "simulation/projective/cholesky.h"
#include "simulation/projective/contact_impulses.h"
#include "simulation/projective/elastic_rows.h"
#include "simulation/projective/options_of_parts.h"
#include "simulation/projective/projective_keeps.h"
#include "simulation/xpbd/backend.h"
#include "simulation/xpbd/prepared_cloth.h"
#include "simulation/xpbd/self_contact_cpu.h"
#include "simulation/xpbd/sweep_math.h"

namespace atelier {
namespace {

constexpr Index kParticleGrain = 2048;
using Lanes = std::vector<Vec4<double>>;

/// Free particles in their order; -1: fixed.
std::vector<int> free_places(const PreparedCloth<double>& prepared, int& count) {
  std::vector<int> place(static_cast<std::size_t>(prepared.count), -1);
  count = 0;
  for (int i = 0; i < prepared.count; ++i) {
    if (prepared.inverse_mass[i] > 0) {
      place[i] = count++;
    }
  }
  return place;
}

}  // namespace

struct ProjectiveSolver::Scene {
  Scene(const Cloth& cloth, const Triangles& body_faces, const SolverOptions& options)
      : cloth(cloth),
        body_faces(body_faces),
        options(options),
        shared(options_of_parts(options)),
        h(options.time_step / options.projective.substeps),
        prepared(prepare_cloth<double>(cloth)),
        rows(make_elastic_rows(cloth, prepared.internal, options.projective.strain_limit)),
        place(free_places(prepared, free_count)),
        mass(particle_masses()),
        inverse_mass(inverse_masses()),
        matrix(projective_matrix(rows, mass, place, free_count, h)),
        factor(matrix, free_positions()),
        body(body_faces, options, cloth.material, options.projective.substeps),
        counted(counted_cloth(cloth, body_faces, shared)) {
    const std::size_t n = static_cast<std::size_t>(prepared.count);
    for (Lanes* lanes : {&x, &start, &solved_from, &velocity, &acceleration, &target, &wish, &v,
                         &at, &force, &reached, &origin, &carry}) {
      lanes->resize(n);
    }
    impulses.hold_gently(stiff_particles());
    of_rows.resize(rows.rows.size());
    solved.resize(static_cast<std::size_t>(free_count));
    touched.resize(n);
    moved.resize(n);
    if (options.self_contact && cloth.faces.rows() > 0) {
      self = std::make_unique<SelfContactCpu<double>>(cloth, prepared, shared);
      self->push_nearer(kGuardShare);
    }
  }

  std::vector<double> particle_masses() const {
    std::vector<double> out(static_cast<std::size_t>(prepared.count));
    for (int i = 0; i < prepared.count; ++i) {
      out[i] = cloth.mass[prepared.external[i]];
    }
    return out;
  }

  std::vector<double> inverse_masses() const {
    std::vector<double> out(mass.size(), 0.0);
    for (std::size_t i = 0; i < mass.size(); ++i) {
      out[i] = place[i] >= 0 ? 1 / mass[i] : 0;
    }
    return out;
  }

  /// 1: particles on which the cloth pulls with so much more than their mass that contact holds
  /// them gently.
  std::vector<char> stiff_particles() const {
    std::vector<char> out(mass.size(), 0);
    for (std::size_t i = 0; i < mass.size(); ++i) {
      out[i] = place[i] >= 0 && is_held_gently(matrix.coeff(place[i], place[i]), mass[i]) ? 1 : 0;
    }
    return out;
  }

  Points free_positions() const {
    Points out(free_count, 3);
    for (int i = 0; i < prepared.count; ++i) {
      if (place[i] >= 0) {
        out.row(place[i]) = cloth.rest_positions.row(prepared.external[i]);
      }
    }
    return out;
  }

  template <class Work>
  void for_particles(const Work& work) const {
    parallel_for(prepared.count, kParticleGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        work(i);
      }
    });
  }

  void begin_frame(const Control& control) {
    const Points targets = pin_targets_of(cloth, control, body_faces, state.positions);
    const Points air = air_accelerations(cloth, state, control, shared);
    for_particles([&](Index i) {
      const int vertex = prepared.external[i];
      const auto lane = [&](const auto& row) { return Vec4<double>{row[0], row[1], row[2], 0}; };
      x[i] = lane(state.positions.row(vertex));
      x[i].w = prepared.inverse_mass[i];
      velocity[i] = lane(state.velocities.row(vertex));
      target[i] = lane(targets.row(vertex));
      acceleration[i] = lane(air.row(vertex) + control.gravity.transpose());
    });
    std::fill(touched.begin(), touched.end(), 0);
    body.begin_frame(control, options.time_step, x, velocity, acceleration);
    if (self != nullptr) {
      self->begin_frame();
    }
  }

  /// Contacts of substep `s`: of the body, and of cloth with cloth, where nothing holds it.
  void find_contacts(int s) {
    origin = x;  // before the body moves old overlaps out: that may not pass other cloth either
    const std::vector<TouchedBody>& on_body = body.find(s, h, x, wish);
    std::vector<TouchedCloth> on_cloth;
    if (self != nullptr) {
      self->begin_substep(options.projective.substeps - s);
      for_particles([&](Index i) { at[i] = with_w(xyz(x[i]) + h * xyz(wish[i]), x[i].w); });
      on_cloth = touching_pairs(*self, {at, start, carry, origin, touched}, h);
    }
    impulses.begin_step(on_body, on_cloth, {body.friction(), self_friction()}, inverse_mass);
  }

  /// Iterations before which contacts are looked for once more, where the cloth pulls by then.
  bool looks_again(int k) const {
    return !body.empty() && looks_across(k, options.projective.iterations);
  }

  /// As many as asked for; more where parts of the body pinch cloth.
  int iterations_of_step() const {
    return options.projective.iterations * (impulses.across().empty() ? 1 : kPinchedIterations);
  }

  /// Contacts of substep `s` across those of the same particles.
  void find_across(int s) {
    if (impulses.add_across(body.find_across(s, h, body.found(), x, v)) > 0) {
      anderson.begin(solved.size(), options.projective.acceleration);  // it is another equation now
    }
  }

  double self_friction() const { return self != nullptr ? self->rule().friction : 0; }

  void substep(int s) {
    const double share = 1.0 / (options.projective.substeps - s);
    for_particles([&](Index i) {
      const bool is_free = place[i] >= 0;
      if (!is_free) {
        velocity[i] = with_w((share / h) * (xyz(target[i]) - xyz(x[i])), 0.0);
      }
      wish[i] = is_free ? with_w(xyz(velocity[i]) + h * xyz(acceleration[i]), 0.0) : velocity[i];
    });
    find_contacts(s);
    solved_from = x;
    v = velocity;
    free_v.resize(solved.size());
    for_particles([&](Index i) {
      if (place[i] >= 0) {
        free_v[place[i]] = v[i];
      }
    });
    anderson.begin(solved.size(), options.projective.acceleration);
    for (int k = 0; k < iterations_of_step(); ++k) {
      if (looks_again(k)) {
        find_across(s);
      }
      iterate();
    }
    start = x;
    for_particles([&](Index i) {
      velocity[i] = v[i];
      x[i] = with_w(xyz(x[i]) + h * xyz(v[i]), x[i].w);
    });
    keep_apart(s);
    const double keep = 1 / (1 + options.velocity_damping * h);
    for_particles([&](Index i) {
      if (moved[i] != 0) {
        velocity[i] = with_w((1 / h) * (xyz(x[i]) - xyz(start[i])), 0.0);
      }
      if (place[i] >= 0) {
        velocity[i] = with_w(keep * xyz(velocity[i]), 0.0);
      }
    });
  }

  /// Forces where velocities `v` lead to.
  void evaluate_forces() {
    for_particles([&](Index i) { at[i] = with_w(xyz(x[i]) + h * xyz(v[i]), 0.0); });
    elastic_forces(rows, at, v, of_rows, force);
  }

  void iterate() {
    evaluate_forces();
    for_particles([&](Index i) {
      reached[i] = with_w(xyz(wish[i]) + (h * inverse_mass[i]) * xyz(force[i]), 0.0);
    });
    impulses.hold(reached, v);
    for_particles([&](Index i) {
      if (place[i] >= 0) {
        solved[place[i]] = with_w(mass[i] * (xyz(reached[i]) - xyz(v[i])), 0.0);
      }
    });
    factor.solve(solved);
    anderson.advance(free_v, solved);
    for_particles([&](Index i) {
      if (place[i] >= 0) {
        v[i] = free_v[place[i]];
      }
    });
  }

  /// Nothing passes: tethers, the body, other cloth. `x` moves, `start` with what was there before.
  void keep_apart(int s) {
    std::fill(moved.begin(), moved.end(), 0);
    std::fill(touched.begin(), touched.end(), 0);
    for (const ContactImpulses::BodyImpulse& c : impulses.with_body()) {
      touched[c.contact.particle] = squared_norm(c.impulse) > 0 ? 1 : 0;
    }
    for (const ContactImpulses::BodyImpulse& c : impulses.across()) {
      if (squared_norm(c.impulse) > 0) {
        touched[c.contact.particle] = 1;
      }
    }
    if (!prepared.tether_anchor.empty()) {
      for_particles([&](Index i) {
        const int anchor = prepared.tether_anchor[i];
        if (anchor >= 0) {
          const Vec4<double> before = x[i];
          project_tether(x[i], xyz(x[anchor]), prepared.tether_length[i]);
          moved[i] = before.x != x[i].x || before.y != x[i].y || before.z != x[i].z ? 1 : 0;
        }
      });
    }
    if (self == nullptr) {
      meet_body(s, false, Meeting::Touches);
      return;
    }
    std::fill(carry.begin(), carry.end(), Vec4<double>{});
    meet_body(s, false, Meeting::Touches);
    const SelfMotion<double> motion{x, start, carry, origin, touched};
    self->push(motion);
    note_moved();
    meet_body(s, true, Meeting::Touches);
    bool kept = false;
    for (int pass = 0; pass < ProjectiveKeeps::kPasses && self->keep_back(motion, pass); ++pass) {
      kept = true;
      note_moved();
      const bool anew = ProjectiveKeeps::asks_body_anew(pass);
      if (anew) {
        for_particles([&](Index i) { carry[i] = with_w(Vec3d{}, carry[i].w); });
      }
      meet_body(s, true, meeting_in_pass(pass), anew);
    }
    if (kept) {
      self->all_kept();
      note_moved();
      meet_body(s, true, Meeting::Leaves);
    }
  }

  void note_moved() {
    for_particles([&](Index i) {
      if (self->moved(static_cast<int>(i))) {
        moved[i] = 1;
      }
    });
  }

  /// `again`: only whom cloth moved since. `anew`: only whom the body touches carries others.
  void meet_body(int s, bool again, Meeting meeting, bool anew = false) {
    if (body.empty()) {
      return;
    }
    parallel_for(prepared.count, kParticleGrain / 8, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        if (again && !self->moved(static_cast<int>(i))) {
          continue;
        }
        const int particle = static_cast<int>(i);
        BodyParticle<double> p{x[i], start[i], {}, xyz(carry[i])};
        const bool touches = body.meet(s, particle, p, again ? origin[i] : start[i], meeting);
        if (touches) {
          touched[i] = 1;
          moved[i] = 1;
        }
        if (p.x.x != x[i].x || p.x.y != x[i].y || p.x.z != x[i].z) {
          moved[i] = 1;
        }
        x[i] = p.x;
        start[i] = p.start;
        if (self != nullptr) {
          const Vec3d carried = anew && !touches ? Vec3d{} : p.moved;
          carry[i] = with_w(carried, self->comes_out(body.outlook(), particle) ? 1.0 : 0.0);
        }
      }
    });
  }

  FrameReport advance(const Control& control) {
    check_control(control, cloth, body_faces.rows() > 0 ? body_faces.maxCoeff() + 1 : 0,
                  options.time_step);
    begin_frame(control);
    for (int s = 0; s < options.projective.substeps; ++s) {
      substep(s);
    }
    body.end_outside(x);
    ClothState next{Points(prepared.count, 3), Points(prepared.count, 3), state.frame + 1};
    for_particles([&](Index i) {
      const int vertex = prepared.external[i];
      next.positions.row(vertex) << x[i].x, x[i].y, x[i].z;
      next.velocities.row(vertex) << velocity[i].x, velocity[i].y, velocity[i].z;
    });
    check_finite(next.positions, next.frame);
    state = std::move(next);
    FrameReport report = begun_report(state.frame);
    report.body_contacts = static_cast<int>(std::count(touched.begin(), touched.end(), 1));
    if (self != nullptr) {
      report.self_contacts = self->active_count();
      report.self_candidates = self->candidate_count();
      report.self_searches = self->search_count();
      report.self_renewals = self->renewal_count();
    }
    if (options.report) {
      const BodyPenetration inside = body.penetration(x);
      report.penetrating = inside.count;
      report.penetration_depth = inside.depth;
    }
    return reported(report, {cloth, counted, options}, control,
                    [&]() -> const ClothState& { return state; });
  }

  ProjectiveResidual residual() const {
    const std::size_t n = static_cast<std::size_t>(prepared.count);
    Lanes led_to(n);
    Lanes forces(n);
    Lanes scratch(of_rows.size());
    for_particles([&](Index i) { led_to[i] = with_w(xyz(solved_from[i]) + h * xyz(v[i]), 0.0); });
    elastic_forces(rows, led_to, v, scratch, forces);
    Lanes implied(n);
    double weight = 0;
    for_particles([&](Index i) {
      implied[i] = with_w(mass[i] * (xyz(v[i]) - xyz(wish[i])) - h * xyz(forces[i]), 0.0);
    });
    for (const ContactImpulses::ClothImpulse& c : impulses.with_cloth()) {
      for (int k = 0; k < 4; ++k) {
        Vec4<double>& of = implied[c.contact.particle[k]];
        of = with_w(xyz(of) - c.contact.weight[k] * c.impulse, 0.0);
      }
    }
    std::vector<char> free_of_contact(n, 1);
    for (const ContactImpulses::BodyImpulse& c : impulses.with_body()) {
      free_of_contact[c.contact.particle] = 0;
    }
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (place[i] >= 0) {
        weight += mass[i] * norm(xyz(acceleration[i])) * h / free_count;
        sum += free_of_contact[i] != 0 ? squared_norm(xyz(implied[i])) : 0;
        count += free_of_contact[i];
      }
    }
    ProjectiveResidual out;
    out.contacts = static_cast<int>(impulses.with_body().size());
    out.cloth_contacts = static_cast<int>(impulses.with_cloth().size());
    if (weight > 0) {
      const ContactImpulses::Residual of_body = impulses.body_residual(implied, v, weight);
      const ContactImpulses::Residual of_cloth = impulses.cloth_residual(v, weight);
      out.contact = of_body.root_mean_square;
      out.worst_contact = of_body.most;
      out.cloth_contact = of_cloth.root_mean_square;
      out.worst_cloth_contact = of_cloth.most;
      out.momentum = count > 0 ? std::sqrt(sum / count) / weight : 0;
    }
    return out;
  }

  Cloth cloth;
  Triangles body_faces;
  SolverOptions options;
  XpbdOptions shared;
  double h;  ///< s, a substep
  PreparedCloth<double> prepared;
  ElasticRows rows;
  int free_count = 0;
  std::vector<int> place;  ///< of particles in the matrix, -1: fixed
  std::vector<double> mass;
  std::vector<double> inverse_mass;    ///< 0: fixed
  Eigen::SparseMatrix<double> matrix;  ///< P, of free particles
  CholeskyFactor<float> factor;        ///< the next iteration mends what it rounds
  BodyContacts body;
  ContactImpulses impulses;
  CountedCloth counted;
  std::unique_ptr<SelfContactCpu<double>> self;  ///< null: no contact with itself
  ClothState state;

  Lanes x;             ///< w: inverse mass
  Lanes start;         ///< at the substep's start
  Lanes solved_from;   ///< the same before what keeps things apart changed it
  Lanes velocity;      ///< m/s
  Lanes acceleration;  ///< of gravity and air
  Lanes target;        ///< of fixed particles at the end of the frame
  Lanes wish;          ///< velocity without elasticity and contact
  Lanes v;             ///< of the iteration
  Lanes at;            ///< where it leads to
  Lanes force, of_rows;
  Lanes reached;  ///< velocity with which a particle leaves the step, first without impulses
  Lanes solved;   ///< change of velocity, of free particles
  Lanes free_v;   ///< `v` of free particles
  AndersonAcceleration anderson;
  Lanes origin, carry;  ///< see SelfMotion
  std::vector<char> touched;
  std::vector<char> moved;  ///< 1: by what keeps things apart after the iterations
};

ProjectiveSolver::ProjectiveSolver(const Cloth& cloth, const Triangles& body_faces,
                                   const SolverOptions& options) {
  SolverOptions checked = options;
  const std::vector<std::string> problems = check_options(describe(checked));
  ATELIER_CHECK(problems.empty(), "options of projective dynamics: " + problems.front());
  scene_ = std::make_unique<Scene>(cloth, body_faces, options);
  set_state(rest_state(cloth));
}
ProjectiveSolver::~ProjectiveSolver() = default;
ProjectiveSolver::ProjectiveSolver(ProjectiveSolver&&) noexcept = default;
ProjectiveSolver& ProjectiveSolver::operator=(ProjectiveSolver&&) noexcept = default;

void ProjectiveSolver::set_state(const ClothState& state) {
  check_state(state, scene_->prepared.count);
  scene_->state = state;
}

ClothState ProjectiveSolver::state() const {
  return scene_->state;
}

FrameReport ProjectiveSolver::advance(const Control& control) {
  return scene_->advance(control);
}

ProjectiveResidual ProjectiveSolver::residual() const {
  return scene_->residual();
}

}  // namespace atelier
