#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/contact/body_encounter.h"
#include "simulation/xpbd/backend.h"
#include "simulation/xpbd/edge_math.h"
#include "simulation/xpbd/edges_avx2.h"
#include "simulation/xpbd/feature_contact_cpu.h"
#include "simulation/xpbd/jacobi_math.h"
#include "simulation/xpbd/prepared_cloth.h"
#include "simulation/xpbd/self_contact_cpu.h"
#include "simulation/xpbd/sweep_math.h"

namespace atelier {
namespace {

template <class T>
Vec3<T> vec(const Points& p, Index row) {
  return {static_cast<T>(p(row, 0)), static_cast<T>(p(row, 1)), static_cast<T>(p(row, 2))};
}

constexpr Index kGrain = 2048;  ///< particles of one task

/// "auto" compares twins on the scalar code where the build is to be exact.
bool use_avx2(const XpbdOptions& options) {
  if (options.vectors == "avx2") {
    if (!avx2_available()) {
      throw EnvironmentError("AVX2", "this processor has none; use vectors \"auto\"");
    }
    return true;
  }
#ifdef ATELIER_EXACT
  return false;
#else
  return options.vectors == "auto" && options.precision == "float" && avx2_available();
#endif
}

template <class T>
class CpuBackend final : public ClothSolver::Backend {
 public:
  CpuBackend(const Cloth& cloth, const ClothVariation& variation, const Triangles& body_faces,
             const XpbdOptions& options)
      : cloth_(cloth),
        variation_(variation),
        body_faces_(body_faces),
        options_(options),
        avx2_(use_avx2(options)),
        prepared_(prepare_cloth<T>(cloth)),
        body_(body_faces) {
    const std::size_t n = cloth.mass.size();
    x_.resize(n);
    start_.resize(n);
    velocity_.resize(n);
    acceleration_.resize(n);
    target_.resize(n);
    lambda_.resize(prepared_.edges.size());
    strain_lambda_.resize(3 * prepared_.strains.size());
    if (options.sweep == "jacobi") {
      jacobi_.plan = prepare_jacobi(prepared_);
      jacobi_.push.resize(4 * jacobi_.plan.edges.size() + 3 * jacobi_.plan.triangles.size());
    }
    if (options.self_contact && cloth.faces.rows() > 0) {
      self_ = std::make_unique<SelfContactCpu<T>>(cloth, prepared_, options);
    }
    if (options.body_edges && body_faces.rows() > 0 && cloth.faces.rows() > 0) {
      features_ = std::make_unique<FeatureContactCpu<T>>(cloth_, prepared_, body_.faces());
    }
  }

  int scene_count() const override { return 1; }

  void set_state(int, const ClothState& state) override {
    check_state(state, prepared_.count);
    state_ = state;
  }

  ClothState state(int) const override { return state_; }

  std::vector<FrameReport> advance(const Control& control) override {
    check_control(control, cloth_, body_faces_.rows() > 0 ? body_faces_.maxCoeff() + 1 : 0,
                  options_.time_step);
    begin_frame(control);
    const T h = static_cast<T>(options_.time_step / options_.substeps);
    for (int s = 0; s < options_.substeps; ++s) {
      if (self_ != nullptr) {
        self_->begin_substep(options_.substeps - s);
      }
      substep(h, s);
    }
    body_.end_outside(rule_, options_.substeps, x_);
    ClothState next{Points(prepared_.count, 3), Points(prepared_.count, 3), state_.frame + 1};
    for (int i = 0; i < prepared_.count; ++i) {
      const int v = prepared_.external[i];
      next.positions.row(v) << x_[i].x, x_[i].y, x_[i].z;
      next.velocities.row(v) << velocity_[i].x, velocity_[i].y, velocity_[i].z;
    }
    check_finite(next.positions, next.frame);
    state_ = std::move(next);
    FrameReport report;
    report.frame = state_.frame;
    report.body_contacts = static_cast<int>(std::count(touched_.begin(), touched_.end(), 1));
    if (self_ != nullptr) {
      report.self_contacts = self_->active_count();
      report.self_candidates = self_->candidate_count();
      report.self_searches = self_->search_count();
      report.self_renewals = self_->renewal_count();
    }
    if (options_.report) {
      const BodyPenetration inside = body_.penetration(rule_.reach, x_);
      report.penetrating = inside.count;
      report.penetration_depth = inside.depth;
      report = report_state(
          cloth_, variation_, state_,
          {multipliers_in_order(prepared_, lambda_.data(), cloth_.schedule.order.size()),
           strain_multipliers(prepared_, strain_lambda_.data()),
           options_.time_step / options_.substeps},
          report);
    }
    return {report};
  }

  std::vector<double> spring_forces(int) const override {
    const double h = options_.time_step / options_.substeps;
    return spring_forces_of(
        cloth_, multipliers_in_order(prepared_, lambda_.data(), cloth_.schedule.order.size()), h);
  }

 private:
  void begin_frame(const Control& control) {
    const Points targets = pin_targets_of(cloth_, control, body_faces_, state_.positions);
    const Points air = air_accelerations(cloth_, state_, control, options_);
    for (int i = 0; i < prepared_.count; ++i) {
      const int v = prepared_.external[i];
      x_[i] = with_w(vec<T>(state_.positions, v), prepared_.inverse_mass[i]);
      velocity_[i] = vec<T>(state_.velocities, v);
      target_[i] = vec<T>(targets, v);
      acceleration_[i] = vec<T>(air, v) + Vec3<T>{static_cast<T>(control.gravity.x()),
                                                  static_cast<T>(control.gravity.y()),
                                                  static_cast<T>(control.gravity.z())};
    }
    begin_body(control);
    if (self_ != nullptr) {
      self_->begin_frame();
    }
  }

  /// Takes over the body's motion of the frame and collects what each particle may meet.
  void begin_body(const Control& control) {
    touched_.assign(x_.size(), 0);
    pushed_.assign(x_.size(), 0);
    carry_.resize(x_.size());
    origin_.resize(x_.size());
    const Material& m = cloth_.material;
    rule_.thickness = static_cast<T>(options_.thickness >= 0 ? options_.thickness : m.thickness);
    rule_.friction = static_cast<T>(variation_.friction >= 0 ? variation_.friction
                                    : options_.friction >= 0 ? options_.friction
                                                             : m.friction);
    rule_.reach = max_of(static_cast<T>(options_.contact_reach), rule_.thickness);
    rule_.old_overlap =
        static_cast<T>(options_.depenetration_speed * options_.time_step / options_.substeps);
    held_.resize(x_.size());
    body_.begin_frame(control, static_cast<T>(options_.time_step), rule_,
                      {x_, velocity_, acceleration_});
    if (features_ != nullptr && !body_.empty()) {
      features_->begin_frame(body_.body(), body_.tree(), rule_, x_, body_.flight(),
                             body_.outlook());
    }
  }

  /// Resolves contacts with the body's features, first of an iteration's contacts. Its faces are
  /// the last.
  void push_off_features(int s) {
    std::fill(pushed_.begin(), pushed_.end(), 0);
    if (features_ != nullptr && !body_.empty()) {
      const T substeps = static_cast<T>(options_.substeps);
      features_->push(x_, start_, static_cast<T>(s) / substeps, static_cast<T>(s + 1) / substeps,
                      pushed_);
    }
  }

  /// All particles against the body's faces.
  void meet_body(int s) {
    touch_body(s, false, Meeting::Touches);
    for (std::size_t i = 0; i < pushed_.size(); ++i) {
      touched_[i] |= pushed_[i];
    }
  }

  /// `again`: only whom cloth moved since.
  void touch_body(int s, bool again, Meeting meeting) {
    const BodySubstep<T> step{body_.body(), rule_,
                              static_cast<T>(s) / static_cast<T>(options_.substeps),
                              static_cast<T>(s + 1) / static_cast<T>(options_.substeps)};
    parallel_for(prepared_.count, kGrain / 4, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        if (!again || self_->moved(static_cast<int>(i))) {
          BodyParticle<T> p{x_[i], start_[i], held_[i], xyz(carry_[i])};
          touched_[i] = meeting == Meeting::Touches
                            ? x_[i].w > T(0) && body_.touch(i, p, step, body_.outlook()[i])
                            : stay_with_body(p, origin_[i], step, body_.outlook()[i], meeting);
          x_[i] = p.x;
          start_[i] = p.start;
          held_[i] = p.held;
          if (self_ != nullptr) {
            const bool out = self_->comes_out(body_.outlook(), static_cast<int>(i));
            carry_[i] = with_w(p.moved, out ? T(1) : T(0));
          }
        }
      }
    });
  }

  void substep(T h, int s) {
    const T share = T(1) / static_cast<T>(options_.substeps - s);
    parallel_for(prepared_.count, kGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        predict(x_[i], start_[i], velocity_[i], ParticleDrive<T>{acceleration_[i], target_[i]},
                share, h);
        held_[i] = {};
        if (self_ != nullptr) {
          origin_[i] = start_[i];
          carry_[i] = {};
        }
      }
    });
    parallel_for(std::ssize(lambda_), 4 * kGrain, [&](Index begin, Index end) {
      std::fill(lambda_.begin() + begin, lambda_.begin() + end, EdgeMultipliers<T>{});
    });
    std::fill(strain_lambda_.begin(), strain_lambda_.end(), T(0));
    const SubstepScale<T> scale = substep_scale(h, static_cast<T>(cloth_.material.damping),
                                                static_cast<T>(1 / variation_.stretch),
                                                static_cast<T>(1 / variation_.bending));
    for (int iteration = 0; iteration < options_.iterations; ++iteration) {
      if (options_.sweep == "jacobi") {
        sweep_jacobi(scale, iteration);
      } else {
        sweep_patches(scale);
      }
      push_off_features(s);
      if (!prepared_.tether_anchor.empty()) {  // anchors are fixed
        parallel_for(prepared_.count, kGrain, [&](Index begin, Index end) {
          for (Index i = begin; i < end; ++i) {
            const int anchor = prepared_.tether_anchor[i];
            if (anchor >= 0) {
              project_tether(x_[i], xyz(x_[anchor]), prepared_.tether_length[i]);
            }
          }
        });
      }
      if (self_ == nullptr) {
        if (!body_.empty()) {
          meet_body(s);
        }
        continue;
      }
      // Cloth on the body has to be known before cloth pushes cloth. In the end nothing passes,
      // neither cloth nor body; where both cannot be, the body wins.
      if (!body_.empty()) {
        meet_body(s);
      }
      const SelfMotion<T> motion{x_, start_, carry_, origin_, touched_};
      self_->push(motion);
      if (!body_.empty()) {
        touch_body(s, true, Meeting::Touches);
      }
      bool kept = false;
      for (int pass = 0; pass < SelfKeeps::kPasses && self_->keep_back(motion, pass); ++pass) {
        kept = true;
        if (!body_.empty()) {
          touch_body(s, true, meeting_in_pass(pass));
        }
      }
      if (kept && !body_.empty()) {
        self_->all_kept();
        touch_body(s, true, Meeting::Leaves);
      }
    }
    const T keep = static_cast<T>(1 / (1 + options_.velocity_damping * static_cast<double>(h)));
    parallel_for(prepared_.count, kGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        update_velocity(x_[i], start_[i], velocity_[i], h, keep);
      }
    });
  }

  void sweep_patches(const SubstepScale<T>& scale) {
    for (const Schedule::Phase& phase : prepared_.phases) {
      parallel_for(phase.patch_end - phase.patch_begin, 1, [&](Index begin, Index end) {
        for (Index p = begin; p < end; ++p) {
          sweep_patch(prepared_.patches[phase.patch_begin + p], scale);
        }
      });
    }
  }

  /// Every constraint from the same positions; see jacobi_math.h.
  void sweep_jacobi(const SubstepScale<T>& scale, int iteration) {
    JacobiState& j = jacobi_;
    j.weight = chebyshev_weight(iteration, j.weight, static_cast<T>(options_.jacobi_radius));
    if (iteration == 0) {
      j.x_before = x_;
      j.lambda_before = lambda_;
      j.strain_before = strain_lambda_;
    }
    const JacobiStart<T> from{x_.data(), start_.data(), scale};
    const Index edges = static_cast<Index>(j.plan.edges.size());
    parallel_for(edges, kGrain, [&](Index begin, Index end) {
      for (Index e = begin; e < end; ++e) {
        const EdgeMultipliers<T> now = lambda_[e];
        const EdgeMultipliers<T> change =
            jacobi_edge(j.plan.edges[e], prepared_.edge_rules[e], from, now, &j.push[4 * e]);
        lambda_[e] = {accelerated(now.hinge, change.hinge, j.lambda_before[e].hinge, j.weight),
                      accelerated(now.spring, change.spring, j.lambda_before[e].spring, j.weight)};
        j.lambda_before[e] = now;
      }
    });
    parallel_for(static_cast<Index>(j.plan.triangles.size()), kGrain, [&](Index begin, Index end) {
      for (Index t = begin; t < end; ++t) {
        T change[3];
        jacobi_triangle(j.plan.triangles[t], prepared_.strains[t], from, &strain_lambda_[3 * t],
                        change, &j.push[4 * edges + 3 * t]);
        for (int c = 0; c < 3; ++c) {
          T& before = j.strain_before[3 * t + c];
          T& lambda = strain_lambda_[3 * t + c];
          const T now = lambda;
          lambda = accelerated(now, change[c], before, j.weight);
          before = now;
        }
      }
    });
    parallel_for(prepared_.count, kGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const Vec4<T> now = x_[i];
        const int first = j.plan.begin[i];
        x_[i] = jacobi_particle(now, j.x_before[i], j.push.data(), j.plan.push.data() + first,
                                j.plan.begin[i + 1] - first, j.weight);
        j.x_before[i] = now;
      }
    });
  }

  /// Projects every constraint of a patch, in a local copy of its particles.
  void sweep_patch(const Schedule::Patch& patch, const SubstepScale<T>& scale) {
    thread_local std::vector<Vec4<T>> local;
    thread_local std::vector<Vec4<T>> local_start;
    const int count = patch.vertex_end - patch.vertex_begin;
    const int* particles = prepared_.patch_particles.data() + patch.vertex_begin;
    local.resize(static_cast<std::size_t>(count) + 1);  // one to spare, see project_edges_avx2
    for (int i = 0; i < count; ++i) {
      local[i] = x_[particles[i]];
    }
    if (scale.gamma > T(0)) {
      local_start.resize(static_cast<std::size_t>(count) + 1);
      for (int i = 0; i < count; ++i) {
        local_start[i] = start_[particles[i]];
      }
    }
    for (int k = patch.colour_begin; k < patch.colour_end; ++k) {
      const PreparedColour& colour = prepared_.colours[k];
      const PreparedColour& next = prepared_.colours[k + 1];
      if constexpr (std::is_same_v<T, float>) {
        if (avx2_) {
          const EdgeRun run{prepared_.edges.data(), prepared_.edge_rules.data(), lambda_.data(),
                            colour.edge_begin, next.edge_begin};
          project_edges_avx2(run, {local.data(), local_start.data(), count}, scale);
        }
      }
      for (int e = colour.edge_begin; !avx2_ && e < next.edge_begin; ++e) {
        project_edge(prepared_.edges[e], prepared_.edge_rules[e], local.data(), local_start.data(),
                     lambda_[e], scale);
      }
      for (int t = colour.strain_begin; t < next.strain_begin; ++t) {
        project_triangle(prepared_.strain_places[t], prepared_.strains[t], local.data(),
                         local_start.data(), &strain_lambda_[3 * t], scale);
      }
    }
    for (int i = 0; i < count; ++i) {
      x_[particles[i]] = local[i];
    }
  }

  Cloth cloth_;
  ClothVariation variation_;
  Triangles body_faces_;
  XpbdOptions options_;
  bool avx2_;
  PreparedCloth<T> prepared_;
  ClothState state_;
  std::vector<Vec4<T>> x_;
  std::vector<Vec4<T>> start_;  ///< positions at the start of the substep
  std::vector<Vec3<T>> velocity_;
  std::vector<Vec3<T>> acceleration_;
  std::vector<Vec3<T>> target_;  ///< of fixed particles at the end of the frame
  std::vector<EdgeMultipliers<T>> lambda_;
  std::vector<T> strain_lambda_;

  struct JacobiState {
    JacobiPlan<T> plan;
    std::vector<Vec4<T>> push;
    T weight = T(1);
    std::vector<Vec4<T>> x_before;  ///< of the iteration before
    std::vector<EdgeMultipliers<T>> lambda_before;
    std::vector<T> strain_before;
  };
  JacobiState jacobi_;  ///< empty unless asked for

  BodyEncounter<T> body_;
  BodyContactRule<T> rule_{};
  std::vector<Vec4<T>> held_;  ///< friction of the substep, see resolve_touch
  std::vector<char> touched_;
  std::vector<char> pushed_;     ///< 1: a feature of the body did in this iteration
  std::vector<Vec4<T>> origin_;  ///< where a substep began, see SelfMotion
  std::vector<Vec4<T>> carry_;
  std::unique_ptr<SelfContactCpu<T>> self_;         ///< null: no contact with itself
  std::unique_ptr<FeatureContactCpu<T>> features_;  ///< null: no body, or its vertices alone
};

}  // namespace

std::unique_ptr<ClothSolver::Backend> make_cpu_backend(const Cloth& cloth,
                                                       const ClothVariation& variation,
                                                       const Triangles& body_faces,
                                                       const XpbdOptions& options) {
  if (options.precision == "double") {
    return std::make_unique<CpuBackend<double>>(cloth, variation, body_faces, options);
  }
  return std::make_unique<CpuBackend<float>>(cloth, variation, body_faces, options);
}

}  // namespace atelier
