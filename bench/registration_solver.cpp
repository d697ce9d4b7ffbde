// One round of clothing registration as a least-squares problem, by the registration's own solver
// and by Ceres: a tube of cloth of 5,000 vertices pulled to 20,000 points and to what images say
// of each face. Both go down from the same start to the energy that is lower than the lowest by a
// part in ten thousand. One thread each. Counters: energy (over the lowest that any reached),
// steps, build_ms (Ceres: its problem and its ordering, again in every round, as the points' faces
// change).
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>

#include <benchmark/benchmark.h>
#include <ceres/ceres.h>

#include "core/mesh.h"
#include "core/normals.h"
#include "core/random.h"
#include "registration/tracking/body_driven_prediction.h"
#include "registration/tracking/cloth_energy.h"

namespace atelier {
namespace {

constexpr int kRound = 72;
constexpr int kRings = 70;
constexpr double kTubeRadius = 0.25;  // m
constexpr double kTubeHeight = 1.2;   // m

/// A term of two linear residuals in a face's corners: what a patch of two images says.
struct PictureRow {
  Eigen::Matrix<double, 2, 9> J;  // m
  Eigen::Vector2d r;              // m2
};

struct Round {
  ClothModel model;
  ClothTerms terms;
  std::vector<PictureRow> pictures;  // of each face
  Points start;
};

Round tube_round() {
  Mesh mesh;
  mesh.vertices.resize(kRound * kRings, 3);
  mesh.faces.resize(2 * kRound * (kRings - 1), 3);
  Index face = 0;
  for (int j = 0; j < kRings; ++j) {
    for (int i = 0; i < kRound; ++i) {
      const double u = 2 * std::numbers::pi * i / kRound;
      mesh.vertices.row(j * kRound + i) << kTubeRadius * std::cos(u),
          kTubeHeight * j / (kRings - 1), -kTubeRadius * std::sin(u);
      if (j + 1 < kRings) {
        const int a = j * kRound + i;
        const int b = j * kRound + (i + 1) % kRound;
        mesh.faces.row(face++) << a, b, a + kRound;
        mesh.faces.row(face++) << a + kRound, b, b + kRound;
      }
    }
  }
  Round round;
  round.model = cloth_model(mesh.vertices, mesh.faces);
  round.start = mesh.vertices;
  ClothTerms& terms = round.terms;
  terms.stretch = 0.1 * 0.1;
  terms.compress = 0.06 * 0.06;
  terms.bend = std::pow(0.012, 4);
  terms.edge_weights = rigid_weights(round.model, 0.02);
  terms.edge_vectors =
      turned_edges(round.model.topology.edges, terms.edge_weights, mesh.vertices, mesh.vertices);
  // Points of a wavy tube, a centimetre off, and noisy.
  Random random{5};
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int point = 0; point < 2; ++point) {
      SurfaceRow row;
      double s = uniform(random);
      double t = uniform(random);
      if (s + t > 1) {
        s = 1 - s;
        t = 1 - t;
      }
      row.barycentric << 1 - s - t, s, t;
      Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        row.vertices[static_cast<std::size_t>(k)] = mesh.faces(f, k);
        row.normal += normals.row(mesh.faces(f, k)).transpose();
        at += row.barycentric[k] * mesh.vertices.row(mesh.faces(f, k));
      }
      row.normal.normalize();
      const double wave = 0.01 * std::sin(40 * at.y()) * std::cos(9 * std::atan2(at.z(), at.x()));
      row.offset = row.normal.dot(at) + wave + 0.001 * normal(random);
      row.weight = areas[f] / 2;
      row.scale = 0.02;
      terms.rows.push_back(row);
    }
    FaceQuadratic quadratic;
    quadratic.face = static_cast<int>(f);
    PictureRow pictures;
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector3d along = Eigen::Vector3d(normal(random), normal(random), normal(random));
      for (int k = 0; k < 3; ++k) {
        pictures.J.block<1, 3>(i, 3 * k) = 0.3 * std::sqrt(areas[f]) * along.transpose();
      }
      pictures.r[i] = 0.005 * std::sqrt(areas[f]) * normal(random);
    }
    quadratic.H = pictures.J.transpose() * pictures.J;
    quadratic.g = pictures.J.transpose() * pictures.r;
    terms.quadratics.push_back(quadratic);
    round.pictures.push_back(pictures);
  }
  terms.origin = mesh.vertices;
  return round;
}

/// sqrt(w) (|a - b| / L - 1), of weight by whether it is longer.
class LengthCost : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  LengthCost(double rest, double stretch, double compress)
      : rest_(rest), stretch_(std::sqrt(stretch)), compress_(std::sqrt(compress)) {}
  bool Evaluate(double const* const* x, double* r, double** J) const override {
    const Eigen::Vector3d along =
        Eigen::Map<const Eigen::Vector3d>(x[0]) - Eigen::Map<const Eigen::Vector3d>(x[1]);
    const double length = std::max(along.norm(), 1e-12);
    const double weight = length > rest_ ? stretch_ : compress_;
    r[0] = weight * (length / rest_ - 1);
    if (J != nullptr) {
      const Eigen::Vector3d slope = weight / (rest_ * length) * along;
      if (J[0] != nullptr) {
        Eigen::Map<Eigen::Vector3d>{J[0]} = slope;
      }
      if (J[1] != nullptr) {
        Eigen::Map<Eigen::Vector3d>{J[1]} = -slope;
      }
    }
    return true;
  }

 private:
  double rest_, stretch_, compress_;
};

/// sum_k slope_k x_k - offset: Rows residuals of as many points as Blocks.
template <int Rows, int... Blocks>
class LinearCost : public ceres::SizedCostFunction<Rows, Blocks...> {
 public:
  static constexpr int kBlocks = sizeof...(Blocks);
  using Slope = Eigen::Matrix<double, Rows, 3, Eigen::RowMajor>;
  LinearCost(std::array<Slope, kBlocks> slopes, Eigen::Matrix<double, Rows, 1> offset)
      : slopes_(slopes), offset_(offset) {}
  bool Evaluate(double const* const* x, double* r, double** J) const override {
    Eigen::Map<Eigen::Matrix<double, Rows, 1>> residual(r);
    residual = -offset_;
    for (int k = 0; k < kBlocks; ++k) {
      const Slope& slope = slopes_[static_cast<std::size_t>(k)];
      residual += slope * Eigen::Map<const Eigen::Vector3d>(x[k]);
      if (J != nullptr && J[k] != nullptr) {
        Eigen::Map<Slope>(J[k], Rows, 3) = slope;
      }
    }
    return true;
  }

 private:
  std::array<Slope, kBlocks> slopes_;
  Eigen::Matrix<double, Rows, 1> offset_;
};

/// Of a squared distance that is weighted already: s / (1 + s / (w c^2)).
class SaturatingLoss : public ceres::LossFunction {
 public:
  explicit SaturatingLoss(double most) : most_(most) {}
  void Evaluate(double s, double* rho) const override {
    const double fall = 1 / (1 + s / most_);
    rho[0] = s * fall;
    rho[1] = fall * fall;
    rho[2] = -2 * fall * fall * fall / most_;
  }

 private:
  double most_;
};

/// The energy as residual blocks over the vertices of `x`, which is row-major.
std::unique_ptr<ceres::Problem> ceres_problem(const Round& round, Points& x) {
  using Three = LinearCost<3, 3, 3>;
  using Hinge = LinearCost<3, 3, 3, 3, 3>;
  using Plane = LinearCost<1, 3, 3, 3>;
  using Picture = LinearCost<2, 3, 3, 3>;
  const ClothModel& model = round.model;
  const ClothTerms& terms = round.terms;
  auto problem = std::make_unique<ceres::Problem>();
  const auto at = [&](Index v) { return x.data() + 3 * v; };
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  for (Index e = 0; e < model.topology.edges.rows(); ++e) {
    double* const a = at(model.topology.edges(e, 0));
    double* const b = at(model.topology.edges(e, 1));
    problem->AddResidualBlock(new LengthCost(model.lengths[e], terms.stretch * model.edge_areas[e],
                                             terms.compress * model.edge_areas[e]),
                              nullptr, a, b);
    const double w = std::sqrt(terms.edge_weights[e]);
    problem->AddResidualBlock(new Three({Three::Slope(w * one), Three::Slope(-w * one)},
                                        w * terms.edge_vectors.row(e).transpose()),
                              nullptr, a, b);
  }
  for (Index h = 0; h < model.hinges.rows(); ++h) {
    std::array<Hinge::Slope, 4> slopes;
    for (int k = 0; k < 4; ++k) {
      slopes[static_cast<std::size_t>(k)] = std::sqrt(terms.bend) * model.hinge_weights(h, k) * one;
    }
    problem->AddResidualBlock(new Hinge(slopes, Eigen::Vector3d::Zero()), nullptr,
                              at(model.hinges(h, 0)), at(model.hinges(h, 1)),
                              at(model.hinges(h, 2)), at(model.hinges(h, 3)));
  }
  for (const SurfaceRow& row : terms.rows) {
    const double w = std::sqrt(row.weight);
    std::array<Plane::Slope, 3> slopes;
    for (int k = 0; k < 3; ++k) {
      slopes[static_cast<std::size_t>(k)] = w * row.barycentric[k] * row.normal.transpose();
    }
    problem->AddResidualBlock(new Plane(slopes, Eigen::Matrix<double, 1, 1>(w * row.offset)),
                              new SaturatingLoss(row.weight * row.scale * row.scale),
                              at(row.vertices[0]), at(row.vertices[1]), at(row.vertices[2]));
  }
  for (const FaceQuadratic& quadratic : terms.quadratics) {
    const PictureRow& pictures = round.pictures[static_cast<std::size_t>(quadratic.face)];
    std::array<Picture::Slope, 3> slopes;
    Eigen::Vector2d offset = -pictures.r;
    for (int k = 0; k < 3; ++k) {
      const auto slope = pictures.J.block<2, 3>(0, 3 * k);
      slopes[static_cast<std::size_t>(k)] = slope;
      offset += slope * terms.origin.row(model.topology.faces(quadratic.face, k)).transpose();
    }
    problem->AddResidualBlock(
        new Picture(slopes, offset), nullptr, at(model.topology.faces(quadratic.face, 0)),
        at(model.topology.faces(quadratic.face, 1)), at(model.topology.faces(quadratic.face, 2)));
  }
  return problem;
}

const Round& the_round() {
  static const Round round = tube_round();
  return round;
}

/// The energy but for a constant, what images say at rest, which Ceres counts too.
double energy_at(const Points& x) {
  return cloth_energy(the_round().model, the_round().terms, x);
}

/// The energy that both are to reach.
double aim() {
  static const double energy = [] {
    ShapeSolver solver(the_round().model);
    Points x = the_round().start;
    for (int step = 0; step < 200; ++step) {
      x = solver.lower(the_round().terms, x);
    }
    const double start = energy_at(the_round().start);
    const double least = energy_at(x);
    return least + 1e-4 * (start - least);
  }();
  return energy;
}

void ours(benchmark::State& state) {
  const Round& round = the_round();
  const double enough = aim();
  ShapeSolver solver(round.model);  // once for a sequence
  Points x;
  double steps = 0;
  for (auto _ : state) {
    x = round.start;
    for (steps = 0; steps < 50 && energy_at(x) > enough; ++steps) {
      x = solver.lower(round.terms, x);
    }
  }
  state.counters["steps"] = steps;
  state.counters["energy"] = energy_at(x) / enough;
}

/// Stops a solver of Ceres at the energy that is asked for.
class Enough : public ceres::IterationCallback {
 public:
  explicit Enough(const Points& x) : x_(x) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*summary*/) override {
    return energy_at(x_) <= aim() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const Points& x_;
};

void by_ceres(benchmark::State& state, ceres::LinearSolverType type,
              ceres::SparseLinearAlgebraLibraryType library) {
  const Round& round = the_round();
  const double enough = aim();
  Points x;
  ceres::Solver::Summary summary;
  double build = 0;
  for (auto _ : state) {
    x = round.start;
    const auto begun = std::chrono::steady_clock::now();
    const auto problem = ceres_problem(round, x);
    build =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
    ceres::Solver::Options options;
    options.linear_solver_type = type;
    options.sparse_linear_algebra_library_type = library;
    options.preconditioner_type = ceres::JACOBI;
    options.num_threads = 1;
    options.max_num_iterations = 50;
    options.initial_trust_region_radius = 1e12;  // Gauss-Newton, as ours
    options.max_trust_region_radius = 1e16;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
    options.update_state_every_iteration = true;
    options.logging_type = ceres::SILENT;
    Enough callback(x);
    options.callbacks = {&callback};
    ceres::Solve(options, problem.get(), &summary);
  }
  state.counters["steps"] = summary.num_successful_steps + summary.num_unsuccessful_steps - 1;
  state.counters["energy"] = energy_at(x) / enough;
  state.counters["build_ms"] = build + 1e3 * summary.preprocessor_time_in_seconds;
  state.counters["linear_ms"] = 1e3 * summary.linear_solver_time_in_seconds;
  state.counters["jacobian_ms"] = 1e3 * summary.jacobian_evaluation_time_in_seconds;
}

BENCHMARK(ours)
    ->Name("registration_round/own")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(by_ceres, cholmod, ceres::SPARSE_NORMAL_CHOLESKY, ceres::SUITE_SPARSE)
    ->Name("registration_round/ceres_suitesparse")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(by_ceres, eigen, ceres::SPARSE_NORMAL_CHOLESKY, ceres::EIGEN_SPARSE)
    ->Name("registration_round/ceres_eigen")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(by_ceres, cgnr, ceres::CGNR, ceres::SUITE_SPARSE)
    ->Name("registration_round/ceres_conjugate_gradients")
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace atelier
