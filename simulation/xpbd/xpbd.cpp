#include "simulation/xpbd/xpbd.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "simulation/cloth/attached_position.h"
#include "simulation/xpbd/backend.h"
#include "simulation/xpbd/constraint_math.h"
#include "simulation/xpbd/prepared_surface.h"

namespace atelier {
namespace {

Vec3d vec(const Points& p, Index i) {
  return {p(i, 0), p(i, 1), p(i, 2)};
}

/// Values of the three constraints of project_strain: warp and weft stretch, cosine between yarns.
std::array<double, 3> strain_values(const ClothStrain& s, const Points& x) {
  const Vec3d e1 = vec(x, s.v1) - vec(x, s.v0);
  const Vec3d e2 = vec(x, s.v2) - vec(x, s.v0);
  const Vec3d fu = s.inverse_rest[0] * e1 + s.inverse_rest[1] * e2;
  const Vec3d fv = s.inverse_rest[2] * e1 + s.inverse_rest[3] * e2;
  const double lu = norm(fu);
  const double lv = norm(fv);
  return {lu - 1, lv - 1, lu > 0 && lv > 0 ? dot(fu, fv) / (lu * lv) : 0};
}

/// Root of the mean of squares that sum up to `sum`; 0 of none.
double root_mean(double sum, std::size_t count) {
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

double percentile(std::vector<double>& values, double share) {
  const auto k = saturating_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

}  // namespace

OptionTable describe(XpbdOptions& options) {
  OptionTable table = describe_common(options);
  return table.add(describe_xpbd(options, options));
}

XpbdOptions xpbd_options(const SolverOptions& options) {
  XpbdOptions xpbd;
  const CommonSolverOptions& common = options;
  static_cast<CommonSolverOptions&>(xpbd) = common;
  static_cast<XpbdMethodOptions&>(xpbd) = options.xpbd;
  return xpbd;
}

void check_control(const Control& control, const Cloth& cloth, Index body_vertices,
                   double time_step) {
  const Index n = cloth.rest_positions.rows();
  ATELIER_CHECK(control.gravity.allFinite() && control.wind.allFinite(),
                "gravity and wind are finite");
  ATELIER_CHECK(control.wind_field.rows() == 0 || control.wind_field.rows() == n,
                "one wind per vertex");
  ATELIER_CHECK(control.pin_targets.rows() == 0 || control.pin_targets.rows() == n,
                "one pin target row per vertex");
  ATELIER_CHECK(control.body_start.rows() == control.body_end.rows(),
                "the body has as many vertices at the end as at the start");
  ATELIER_CHECK(control.body_start.rows() == 0 || control.body_start.rows() >= body_vertices,
                "the body's faces name vertices that are not there");
  if (!control.body_start.allFinite() || !control.body_end.allFinite()) {
    throw DataError("", "body", "a vertex that is not finite", "finite positions");
  }
  if (control.body_start.rows() > 0) {
    // Nothing that a cloth could follow moves a metre in a frame, and no part of a person moves at
    // 40 m/s (a pitcher's hand comes near): below 40 frames a second the metre decides.
    constexpr double kMaxMetres = 1.0;
    constexpr double kMaxSpeed = 40.0;
    const double most = std::min(kMaxMetres, kMaxSpeed * time_step);
    Index worst = 0;
    const double jump =
        (control.body_end - control.body_start).rowwise().squaredNorm().maxCoeff(&worst);
    if (jump > most * most) {
      char found[80];
      std::snprintf(found, sizeof found, "moves %.3g m in one frame, at %.3g m/s", std::sqrt(jump),
                    std::sqrt(jump) / time_step);
      char expected[120];
      std::snprintf(expected, sizeof expected,
                    "less than %.3g m a frame: the body must not teleport; add frames between",
                    most);
      throw DataError("", "body vertex " + std::to_string(worst), found, expected);
    }
  }
}

void check_state(const ClothState& state, int particles) {
  ATELIER_CHECK(state.positions.rows() == particles && state.velocities.rows() == particles,
                "the state is of another cloth");
  check_finite(state.positions, state.frame);
  for (Index v = 0; v < state.velocities.rows(); ++v) {
    if (!state.velocities.row(v).allFinite()) {
      throw DataError("", "frame " + std::to_string(state.frame) + ", vertex " + std::to_string(v),
                      "a velocity that is not finite", "finite numbers, m/s");
    }
  }
}

void throw_not_finite(std::int64_t frame, int vertex) {
  throw DataError("", "frame " + std::to_string(frame) + ", vertex " + std::to_string(vertex),
                  "a position that is not finite",
                  "a simulation that stays finite: more substeps, or check material and body");
}

void check_finite(const Points& positions, std::int64_t frame) {
  for (Index v = 0; v < positions.rows(); ++v) {
    if (!positions.row(v).allFinite()) {
      throw_not_finite(frame, static_cast<int>(v));
    }
  }
}

Points pin_targets_of(const Cloth& cloth, const Control& control, const Triangles& body_faces,
                      const Points& positions) {
  Points out = positions;
  if (control.pin_targets.rows() > 0) {
    for (std::size_t v = 0; v < cloth.fixed.size(); ++v) {
      if (cloth.fixed[v]) {
        out.row(static_cast<Index>(v)) = control.pin_targets.row(static_cast<Index>(v));
      }
    }
  }
  if (control.body_end.rows() > 0) {
    for (const Attachment& a : cloth.attachments) {
      ATELIER_CHECK(a.triangle >= 0 && a.triangle < body_faces.rows(),
                    "attachment to triangle " + std::to_string(a.triangle) + " of the body");
      out.row(a.vertex) = attached_position(a, control.body_end, body_faces).transpose();
    }
  }
  return out;
}

Points air_accelerations(const Cloth& cloth, const ClothState& state, const Control& control,
                         const XpbdOptions& options) {
  Points out = Points::Zero(state.positions.rows(), 3);
  if (options.air_density <= 0 || (options.drag <= 0 && options.lift <= 0)) {
    return out;
  }
  for (Index f = 0; f < cloth.faces.rows(); ++f) {
    const Eigen::RowVector3i v = cloth.faces.row(f);
    const Eigen::Vector3d e1 = (state.positions.row(v[1]) - state.positions.row(v[0])).transpose();
    const Eigen::Vector3d e2 = (state.positions.row(v[2]) - state.positions.row(v[0])).transpose();
    Eigen::Vector3d normal = e1.cross(e2);
    const double twice_area = normal.norm();
    if (!(twice_area > 1e-14)) {
      continue;
    }
    normal /= twice_area;
    Eigen::Vector3d air = control.wind;
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();
    double mass = 0;
    for (int c = 0; c < 3; ++c) {
      motion += state.velocities.row(v[c]).transpose() / 3;
      if (control.wind_field.rows() > 0) {
        air += control.wind_field.row(v[c]).transpose() / 3;
      }
      mass += cloth.mass[v[c]] / 3;
    }
    const Eigen::Vector3d u = air - motion;
    const double along = u.dot(normal);
    const double pressure = 0.25 * options.air_density * twice_area;  // 1/2 rho A
    Eigen::Vector3d force = pressure * options.drag * std::abs(along) * along * normal;
    const Eigen::Vector3d across = normal - (u.squaredNorm() > 0 ? along / u.squaredNorm() : 0) * u;
    force += pressure * options.lift * along * u.norm() * across;
    // Explicit over a frame: at most what stops the relative motion.
    const double most = mass * u.norm() / options.time_step;
    if (force.norm() > most) {
      force *= most / force.norm();
    }
    for (int c = 0; c < 3; ++c) {
      out.row(v[c]) += force.transpose() / (3 * cloth.mass[v[c]]);
    }
  }
  return out;
}

FrameReport report_state(const Cloth& cloth, const ClothVariation& variation,
                         const ClothState& state, const LastMultipliers& last, FrameReport report) {
  const auto& [lambda, strain_lambda, substep] = last;
  const double h2 = substep * substep;
  std::vector<double> strain;
  strain.reserve(static_cast<std::size_t>(cloth.fibre_count));
  for (int i = 0; i < cloth.fibre_count; ++i) {
    const ClothSpring& s = cloth.springs[i];
    if (s.rest > 0) {
      const double length = (state.positions.row(s.a) - state.positions.row(s.b)).norm();
      strain.push_back(std::abs(length / s.rest - 1));
    }
  }
  if (!strain.empty()) {
    report.strain_max = *std::max_element(strain.begin(), strain.end());
    report.strain_p50 = percentile(strain, 0.5);
    report.strain_p95 = percentile(strain, 0.95);
  }
  report.kinetic_energy = 0;
  for (std::size_t v = 0; v < cloth.mass.size(); ++v) {
    if (!cloth.fixed[v]) {
      report.kinetic_energy +=
          0.5 * cloth.mass[v] * state.velocities.row(static_cast<Index>(v)).squaredNorm();
    }
  }
  report.elastic_energy = 0;
  double spring_sum = 0;
  double hinge_sum = 0;
  double strain_sum = 0;
  std::size_t spring_count = 0;
  std::size_t hinge_count = 0;
  std::size_t strain_count = 0;
  const int springs = static_cast<int>(cloth.springs.size());
  const int hinges = springs + static_cast<int>(cloth.hinges.size());
  for (std::size_t i = 0; i < cloth.schedule.order.size(); ++i) {
    const int c = cloth.schedule.order[i];
    const bool spring = c < springs;
    double value = 0;
    double stiffness = 0;
    if (spring) {
      const ClothSpring& s = cloth.springs[c];
      value = spring_value(vec(state.positions, s.a), vec(state.positions, s.b), s.rest).c;
      stiffness = s.stiffness * variation.stretch;
    } else if (c < hinges) {
      const ClothHinge& h = cloth.hinges[c - springs];
      const HingeValue<double> hinge =
          hinge_value(vec(state.positions, h.edge0), vec(state.positions, h.edge1),
                      vec(state.positions, h.left), vec(state.positions, h.right));
      value = hinge.valid ? angle_difference(hinge.angle, h.rest) : 0;
      stiffness = h.stiffness * variation.bending;
    } else {
      const auto strain_at = static_cast<std::size_t>(c - hinges);
      const ClothStrain& s = cloth.strains[strain_at];
      const std::array<double, 3> values = strain_values(s, state.positions);
      const std::array<double, 3> stiffnesses = {s.warp, s.weft, s.shear};
      for (std::size_t k = 0; k < 3; ++k) {
        const double of_scene = stiffnesses[k] * variation.stretch;
        report.elastic_energy += 0.5 * of_scene * values[k] * values[k];
        if (strain_at < strain_lambda.size() && of_scene > 0) {
          const double residual = values[k] + strain_lambda[strain_at][k] / (of_scene * h2);
          strain_sum += residual * residual;
          ++strain_count;
        }
      }
      continue;
    }
    report.elastic_energy += 0.5 * stiffness * value * value;
    if (i < lambda.size()) {
      const double residual = value + lambda[i] / (stiffness * h2);
      (spring ? spring_sum : hinge_sum) += residual * residual;
      ++(spring ? spring_count : hinge_count);
    }
  }
  if (!lambda.empty()) {
    report.spring_residual = root_mean(spring_sum, spring_count);
    report.hinge_residual = root_mean(hinge_sum, hinge_count);
  }
  report.strain_residual = strain_count > 0 ? root_mean(strain_sum, strain_count) : -1;
  return report;
}

std::vector<double> spring_forces_of(const Cloth& cloth, const std::vector<double>& lambda,
                                     double substep) {
  std::vector<double> out(cloth.springs.size(), 0.0);
  for (std::size_t i = 0; i < lambda.size(); ++i) {
    const int c = cloth.schedule.order[i];
    if (c < static_cast<int>(out.size())) {
      out[c] = -lambda[i] / (substep * substep);
    }
  }
  return out;
}

CountedCloth counted_cloth(const Cloth& cloth, const Triangles& body_faces,
                           const XpbdOptions& options) {
  return {cloth.faces,
          body_faces,
          cloth.rest_positions,
          cloth.layer,
          options.thickness >= 0 ? options.thickness : cloth.material.thickness,
          options.self_contact ? kept_self_thickness(cloth, options) : 0};
}

std::string xpbd_conflict(const XpbdOptions& options, Device device) {
  if (device == Device::Cpu && options.vectors == "avx2" && options.precision != "float") {
    return "vectors \"avx2\" work with precision \"float\" alone";
  }
  if (device == Device::Cuda && options.sweep != "gauss-seidel" && options.self_contact) {
    return "Jacobi sweeps with contact of the cloth with itself run on the CPU alone";
  }
  return "";
}

namespace {

void check_setup(const XpbdOptions& options, const std::vector<ClothVariation>& variations,
                 Device device) {
  XpbdOptions checked = options;
  const std::vector<std::string> problems = check_options(describe(checked));
  ATELIER_CHECK(problems.empty(), "XPBD options: " + problems.front());
  const std::string conflict = xpbd_conflict(options, device);
  ATELIER_CHECK(conflict.empty(), conflict);
  ATELIER_CHECK(!variations.empty(), "a sweep of no scenes");
  for (const ClothVariation& v : variations) {
    ATELIER_CHECK(
        std::isfinite(v.stretch) && v.stretch > 0 && std::isfinite(v.bending) && v.bending > 0,
        "factors of a variation are above 0");
  }
}

}  // namespace

ClothSolver::ClothSolver(const Cloth& cloth, const Triangles& body_faces,
                         const XpbdOptions& options, Device device)
    : counted_(counted_cloth(cloth, body_faces, options)), options_(options) {
  check_setup(options, {ClothVariation{}}, device);
  ATELIER_CHECK(cloth.curvatures.empty(), "XPBD has hinges, not curvatures of vertices");
  backend_ = device == Device::Cpu
                 ? make_cpu_backend(cloth, {}, body_faces, options)
                 : make_cuda_backend(cloth, {ClothVariation{}}, body_faces, options);
  backend_->set_state(0, rest_state(cloth));
}
ClothSolver::~ClothSolver() = default;
ClothSolver::ClothSolver(ClothSolver&&) noexcept = default;
ClothSolver& ClothSolver::operator=(ClothSolver&&) noexcept = default;

void ClothSolver::set_state(const ClothState& state) {
  backend_->set_state(0, state);
}
ClothState ClothSolver::state() const {
  return backend_->state(0);
}

FrameReport ClothSolver::advance(const Control& control) {
  const FrameReport report = backend_->advance(control)[0];
  if (counts_due(options_, control, report.frame)) {
    return with_exact_counts(report, counted_, backend_->state(0).positions, control);
  }
  return report;
}
std::vector<double> ClothSolver::spring_forces() const {
  return backend_->spring_forces(0);
}

ClothSweep::ClothSweep(const Cloth& cloth, const std::vector<ClothVariation>& variations,
                       const Triangles& body_faces, const XpbdOptions& options, Device device) {
  check_setup(options, variations, device);
  if (device == Device::Cuda) {
    backends_.push_back(make_cuda_backend(cloth, variations, body_faces, options));
  } else {
    for (const ClothVariation& v : variations) {
      backends_.push_back(make_cpu_backend(cloth, v, body_faces, options));
    }
  }
  for (int scene = 0; scene < static_cast<int>(variations.size()); ++scene) {
    set_state(scene, rest_state(cloth));
  }
}
ClothSweep::~ClothSweep() = default;
ClothSweep::ClothSweep(ClothSweep&&) noexcept = default;
ClothSweep& ClothSweep::operator=(ClothSweep&&) noexcept = default;

int ClothSweep::scene_count() const {
  return backends_.size() > 1 ? static_cast<int>(backends_.size()) : backends_[0]->scene_count();
}
void ClothSweep::set_state(int scene, const ClothState& state) {
  ATELIER_CHECK(scene >= 0 && scene < scene_count(),
                "scene " + std::to_string(scene) + " of the sweep");
  backends_.size() > 1 ? backends_[static_cast<std::size_t>(scene)]->set_state(0, state)
                       : backends_[0]->set_state(scene, state);
}
ClothState ClothSweep::state(int scene) const {
  ATELIER_CHECK(scene >= 0 && scene < scene_count(),
                "scene " + std::to_string(scene) + " of the sweep");
  return backends_.size() > 1 ? backends_[static_cast<std::size_t>(scene)]->state(0)
                              : backends_[0]->state(scene);
}
std::vector<FrameReport> ClothSweep::advance(const Control& control) {
  std::vector<FrameReport> out;
  for (const std::unique_ptr<ClothSolver::Backend>& backend : backends_) {
    const std::vector<FrameReport> reports = backend->advance(control);
    out.insert(out.end(), reports.begin(), reports.end());
  }
  return out;
}

#ifndef ATELIER_HAS_CUDA
std::unique_ptr<ClothSolver::Backend> make_cuda_backend(const Cloth&,
                                                        const std::vector<ClothVariation>&,
                                                        const Triangles&, const XpbdOptions&) {
  throw EnvironmentError("CUDA", "this build has none");
}
#endif

}  // namespace atelier
