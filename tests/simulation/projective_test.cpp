// Projective dynamics against known answers; what all solvers promise is in solver_test.cpp.
#include "simulation/projective/projective.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "simulation/cloth/attached_position.h"
#include "simulation/projective/cholesky.h"
#include "simulation/projective/elastic_math.h"
#include "simulation/projective/elastic_rows.h"
#include "simulation/projective/panel_products.h"
#include "tests/simulation/elastica.h"
#include "tests/simulation/implicit_euler.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

SolverOptions projective_statics(double time_step, int substeps, int iterations, double damping) {
  SolverOptions options;
  options.name = "projective-friction";
  options.time_step = time_step;
  options.projective.substeps = substeps;
  options.projective.iterations = iterations;
  options.velocity_damping = damping;
  options.report = false;
  return options;
}

ClothState settled(ProjectiveSolver& solver, const Control& control, int most, double rest_speed) {
  for (int i = 0; i < most; ++i) {
    solver.advance(control);
    if (i % 10 == 9 && solver.state().velocities.rowwise().norm().maxCoeff() < rest_speed) {
      break;
    }
  }
  return solver.state();
}

// T7.
TEST(ProjectiveCantilever, LoadedCantilever_MatchesTheElastica) {
  for (const fixtures::ElasticaRow& row : fixtures::kElastica) {
    const fixtures::ClampedStrip held =
        fixtures::clamped_strip(fixtures::strip('e', 24), row.gamma, fixtures::Across::Straight);
    ProjectiveSolver solver(held.cloth, {},
                            projective_statics(held.slow / 60, 20, 10, 20 / held.slow));
    const fixtures::Tip tip = fixtures::tip_at(held.mesh, settled(solver, {}, 200, 1e-6).positions);
    const auto check = [&](const char* of, double found, double expected) {
      EXPECT_NEAR(found / expected, 1, 0.02) << of << ", gamma " << row.gamma;
      RecordProperty(std::string(of) + "_off_at_" + std::to_string(row.gamma),
                     std::to_string(found / expected - 1));
    };
    check("drop", tip.drop, row.drop);
    check("out", tip.out, row.out);
    check("chord", tip.chord(), row.chord);
    check("slope", tip.slope, row.slope);
  }
}

// T8.
TEST(ProjectiveHeartLoop, Loop_HangsAsTheElastica) {
  for (const fixtures::HeartLoopRow& row : fixtures::kHeartLoops) {
    const fixtures::HeartLoopScene loop = fixtures::heart_loop_scene(row.load);
    ProjectiveSolver solver(loop.cloth, {},
                            projective_statics(loop.frame, 60, 10, 0.5 / loop.frame));
    solver.set_state(loop.start);
    const ClothState state = settled(solver, loop.control, 60, 1e-6);
    const double drop = -state.positions.col(1).minCoeff() / fixtures::kLength;
    EXPECT_NEAR(drop / row.drop, 1, 0.02) << "load " << row.load;
    RecordProperty("off_at_" + std::to_string(row.load), std::to_string(drop / row.drop - 1));
  }
}

// T4: n links of spring k with masses m hang m g / k n (n + 1) / 2 longer.
TEST(ProjectiveChain, HangingChain_StretchesByItsWeight) {
  const int links = 20;
  const Cloth cloth = fixtures::chain(links, 0.05, 1000, 0.01, 0.01);
  ProjectiveSolver solver(cloth, {}, projective_statics(1.0 / 60, 10, 20, 10));
  const ClothState state = settled(solver, {}, 600, 1e-9);
  const double expected = 0.01 * 9.81 / 1000 * links * (links + 1) / 2;
  const double found = -state.positions.col(1).minCoeff() - 0.05 * links;
  EXPECT_NEAR(found / expected, 1, 1e-4);
}

// T5: a strip stretches by rho g L^2 / (2 Y) under its own weight.
TEST(ProjectiveStrip, HangingStrip_StretchesByItsWeight) {
  const Mesh mesh = fixtures::sheet(4, 40, 0.02, 'e');
  const double length = mesh.vertices.col(2).maxCoeff();
  Garment garment = fixtures::garment_of(mesh, 0.2, 100, 0);
  fixtures::use_flat_rest(garment);
  ClothOptions options;
  options.membrane = "strain";
  const std::vector<int> top =
      fixtures::vertices_where(mesh.vertices, [](double, double, double z) { return z < 1e-9; });
  ProjectiveSolver solver(make_cloth(garment, top, options), {},
                          projective_statics(1.0 / 60, 10, 20, 10));
  Control control;
  control.gravity = {0, 0, 9.81};
  const ClothState state = settled(solver, control, 400, 1e-7);
  const double expected = 0.2 * 9.81 * length * length / (2 * 100);
  const double found = state.positions.col(2).maxCoeff() - length;
  EXPECT_NEAR(found / expected, 1, 0.01);
  RecordProperty("off", std::to_string(found / expected - 1));
}

double height_energy(const Cloth& cloth, const Points& positions) {
  double sum = 0;
  for (std::size_t v = 0; v < cloth.mass.size(); ++v) {
    sum += 9.81 * cloth.mass[v] * positions(static_cast<Index>(v), 1);
  }
  return sum;
}

double motion_energy(const Cloth& cloth, const Points& velocities) {
  double sum = 0;
  for (std::size_t v = 0; v < cloth.mass.size(); ++v) {
    sum += 0.5 * cloth.mass[v] * velocities.row(static_cast<Index>(v)).squaredNorm();
  }
  return sum;
}

// Implicit Euler takes energy out: a sheet that swings, strikes a ball and slides off never gains,
// not even the energy of a fall by 20 um, and in the end has lost most of what it had to lose.
TEST(ProjectiveEnergy, NothingFeedsACloth_EnergyFalls) {
  Garment garment = fixtures::garment_of(fixtures::sheet(12, 12, 0.02, 'a'), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(1).array() += 0.15;
  const Mesh ball = fixtures::sphere(0.1, 24, 48);
  const Cloth cloth = make_cloth(garment, {0});
  SolverOptions options = projective_statics(1.0 / 60, 10, 20, 0);
  options.report = true;
  ProjectiveSolver solver(cloth, ball.faces, options);
  double weight = 0;
  for (const double mass : cloth.mass) {
    weight += 9.81 * mass;
  }
  const double start = height_energy(cloth, solver.state().positions);
  double last = start;
  int touched = 0;
  for (int i = 0; i < 240; ++i) {
    const FrameReport report = solver.advance(fixtures::still(ball.vertices));
    touched = std::max(touched, report.body_contacts);
    const double energy = report.kinetic_energy + report.elastic_energy +
                          height_energy(cloth, solver.state().positions);
    EXPECT_LT(energy, last + 2e-5 * weight) << i;
    last = energy;
  }
  EXPECT_GT(touched, 5) << "it struck the ball";
  EXPECT_GT(start - last, 0.1 * weight) << "it has come down";
  EXPECT_LT(motion_energy(cloth, solver.state().velocities), 0.2 * (start - last));
}

// A chain that swings freely loses in each step what implicit Euler takes: the energy of the change
// of its velocities, and that by which its springs' energy lies below its tangent. Not more.
TEST(ProjectiveEnergy, SwingingChain_LosesWhatImplicitEulerLoses) {
  const int links = 10;
  const double h = 1.0 / 600;
  const Cloth cloth = fixtures::chain(links, 0.05, 100, 0.01, 0.01);
  ProjectiveSolver solver(cloth, {}, projective_statics(h, 1, 60, 0));
  ClothState state = rest_state(cloth);
  for (Index v = 0; v < state.velocities.rows(); ++v) {
    state.velocities(v, 0) = cloth.fixed[static_cast<std::size_t>(v)] ? 0 : 0.5 + 0.1 * v;
  }
  solver.set_state(state);
  const auto along = [&](const ClothState& of, const ClothSpring& s) -> Eigen::RowVector3d {
    return of.positions.row(s.a) - of.positions.row(s.b);
  };
  const auto of_spring = [&](const ClothState& of, const ClothSpring& s) {
    return 0.5 * s.stiffness * std::pow(along(of, s).norm() - s.rest, 2);
  };
  const auto energy = [&](const ClothState& of) {
    double sum = motion_energy(cloth, of.velocities) + height_energy(cloth, of.positions);
    for (const ClothSpring& s : cloth.springs) {
      sum += of_spring(of, s);
    }
    return sum;
  };
  double lost = 0;
  double expected = 0;
  for (int i = 0; i < 120; ++i) {
    solver.advance({});
    const ClothState next = solver.state();
    expected += motion_energy(cloth, next.velocities - state.velocities);
    for (const ClothSpring& s : cloth.springs) {
      const Eigen::RowVector3d after = along(next, s);
      const Eigen::RowVector3d slope = s.stiffness * (1 - s.rest / after.norm()) * after;
      expected += of_spring(state, s) - of_spring(next, s) + slope.dot(after - along(state, s));
    }
    lost += energy(state) - energy(next);
    state = next;
  }
  EXPECT_NEAR(lost / expected, 1, 1e-4);
  RecordProperty("lost_over_expected", std::to_string(lost / expected));
}

/// Two layers that fall on a moving ball and on each other.
ClothState fallen(int threads) {
  set_thread_count(threads);
  Garment garment = fixtures::garment_of(fixtures::sheet(40, 40, 0.01, 'a'), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(1).array() += 0.102;
  Garment outer = garment;
  outer.mesh.vertices.col(1).array() += 0.003;
  const Mesh ball = fixtures::sphere(0.1, 12, 24);
  SolverOptions options = projective_statics(1.0 / 60, 4, 5, 0);
  options.self_contact = true;
  options.report = true;
  ProjectiveSolver solver(join_cloths({make_cloth(garment), make_cloth(outer)}), ball.faces,
                          options);
  for (int i = 0; i < 10; ++i) {
    Control control;
    control.body_start = ball.vertices.rowwise() + Eigen::RowVector3d(0.005 * i, 0, 0);
    control.body_end = ball.vertices.rowwise() + Eigen::RowVector3d(0.005 * (i + 1), 0, 0);
    solver.advance(control);
  }
  set_thread_count(0);
  return solver.state();
}

TEST(ProjectiveThreads, Result_DoesNotDependOnTheirNumber) {
  const ClothState one = fallen(1);
  for (const int threads : {2, 7}) {
    const ClothState other = fallen(threads);
    EXPECT_EQ(one.positions, other.positions) << threads;
    EXPECT_EQ(one.velocities, other.velocities) << threads;
  }
}

// A body that moves 40 cm in a frame passes nothing through.
TEST(ProjectiveSwept, FastBody_TakesTheClothAlong) {
  Garment garment = fixtures::garment_of(fixtures::sheet(8, 8, 0.02, 'a'), 0.2, 300, 1e-5);
  garment.mesh.vertices.rowwise() -= Eigen::RowVector3d(0.08, 0.3, 0.08);
  const Mesh ball = fixtures::sphere(0.15, 24, 48);
  ProjectiveSolver solver(make_cloth(garment), ball.faces, projective_statics(1.0 / 60, 2, 5, 0));
  Points at = ball.vertices;
  for (int i = 0; i < 6; ++i) {
    Control control;
    control.body_start = at;
    at.col(1).array() -= 0.4;
    control.body_end = at;
    const FrameReport report = solver.advance(control);
    EXPECT_EQ(report.penetrating, 0);
    const Points inside = solver.state().positions.rowwise() - at.colwise().mean();
    EXPECT_GT(inside.rowwise().norm().minCoeff(), 0.145) << i;
  }
  EXPECT_LT(solver.state().positions.col(1).mean(), -2);
}

TEST(ElasticRows, Forces_AreTheGradientOfTheEnergy) {
  Garment garment = fixtures::garment_of(fixtures::sheet(3, 3, 0.1, 'a'), 0.2, 300, 1e-2);
  fixtures::use_flat_rest(garment);
  ClothOptions options;
  for (const char* membrane : {"springs", "strain"}) {
    options.membrane = membrane;
    const Cloth cloth = make_cloth(garment, {0}, options);
    std::vector<int> internal(cloth.mass.size());
    for (std::size_t i = 0; i < internal.size(); ++i) {
      internal[i] = static_cast<int>(i);
    }
    const ElasticRows rows = make_elastic_rows(cloth, internal);
    const std::size_t n = internal.size();
    Random random{1, 0, 0};
    std::vector<Vec4<double>> x(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto p = cloth.rest_positions.row(static_cast<Index>(i));
      x[i] = {p[0] + 0.02 * uniform(random), p[1] + 0.02 * uniform(random),
              p[2] + 0.02 * uniform(random), 0};
    }
    const std::vector<Vec4<double>> still(n);
    std::vector<Vec4<double>> of_rows(rows.rows.size());
    std::vector<Vec4<double>> force(n);
    elastic_forces(rows, x, still, of_rows, force);
    const auto energy = [&] {
      double sum = 0;
      for (std::size_t r = 0; r < rows.rows.size(); ++r) {
        const ElasticRow& row = rows.rows[r];
        Vec3d value{};
        for (int k = 0; k < 4; ++k) {
          value += row.particle[k] >= 0 ? row.weight[k] * xyz(x[row.particle[k]]) : Vec3d{};
        }
        if (static_cast<int>(r) < rows.bend_begin) {
          const double off = norm(value) - rows.spring_rest[r];
          sum += 0.5 * row.stiffness * off * off;
        } else if (static_cast<int>(r) < rows.yarn_begin) {
          // An angle's square is t + t^2 / 12 + t^3 / 90 + ...
          const double t = squared_norm(value);
          sum += 0.5 * row.stiffness * t * (1 + t / 12 + t * t / 90);
        } else if ((static_cast<int>(r) - rows.yarn_begin) % 2 == 0) {
          const auto& moduli = rows.yarn_moduli[(r - rows.yarn_begin) / 2];
          Vec3d weft{};
          for (int k = 0; k < 3; ++k) {
            weft += rows.rows[r + 1].weight[k] * xyz(x[row.particle[k]]);
          }
          const double cosine = dot(value, weft) / (norm(value) * norm(weft));
          sum += 0.5 * moduli[0] * (norm(value) - 1) * (norm(value) - 1) +
                 0.5 * moduli[1] * (norm(weft) - 1) * (norm(weft) - 1) +
                 0.5 * moduli[2] * cosine * cosine;
        }
      }
      return sum;
    };
    for (std::size_t i = 1; i < n; ++i) {
      const double step = 1e-6;
      double* const place[3] = {&x[i].x, &x[i].y, &x[i].z};
      const double found[3] = {force[i].x, force[i].y, force[i].z};
      for (int axis = 0; axis < 3; ++axis) {
        const double at = *place[axis];
        *place[axis] = at + step;
        const double high = energy();
        *place[axis] = at - step;
        const double low = energy();
        *place[axis] = at;
        EXPECT_NEAR(found[axis], -(high - low) / (2 * step), 1e-5) << membrane << i;
      }
    }
  }
}

/// What damping takes from the motion `v` at `x`, W: each spring's length, each yarn's and their
/// cosine, each flat bend's row changes at a rate, by differences in time.
double damped_power(const ElasticRows& rows, const std::vector<Vec4<double>>& x,
                    const std::vector<Vec4<double>>& v) {
  const double dt = 1e-6;
  const auto row_at = [&](std::size_t r, double time) {
    Vec3d sum{};
    for (int k = 0; k < 4; ++k) {
      const int i = rows.rows[r].particle[k];
      sum += i >= 0 ? rows.rows[r].weight[k] * (xyz(x[i]) + time * xyz(v[i])) : Vec3d{};
    }
    return sum;
  };
  const auto squared_rate = [&](const auto& measure) {
    const double rate = (measure(dt) - measure(-dt)) / (2 * dt);
    return rate * rate;
  };
  double sum = 0;
  for (std::size_t r = 0; r < rows.rows.size(); ++r) {
    const auto length = [&](double time) { return norm(row_at(r, time)); };
    const int row = static_cast<int>(r);
    if (row < rows.bend_begin) {
      sum += rows.rows[r].stiffness * squared_rate(length);
    } else if (row < rows.yarn_begin) {
      sum += rows.rows[r].stiffness * squared_norm((1 / dt) * (row_at(r, dt) - row_at(r, 0)));
    } else if ((row - rows.yarn_begin) % 2 == 0) {
      const auto& moduli = rows.yarn_moduli[static_cast<std::size_t>(row - rows.yarn_begin) / 2];
      const auto weft = [&](double time) { return norm(row_at(r + 1, time)); };
      const auto cosine = [&](double time) {
        return dot(row_at(r, time), row_at(r + 1, time)) / (length(time) * weft(time));
      };
      sum += moduli[0] * squared_rate(length) + moduli[1] * squared_rate(weft) +
             moduli[2] * squared_rate(cosine);
    }
  }
  return rows.damping * sum;
}

// Damping is minus the gradient of half the power that it takes (Rayleigh's function), in either
// membrane.
TEST(ElasticRows, Damping_IsTheGradientOfItsPower) {
  Garment garment = fixtures::garment_of(fixtures::sheet(3, 3, 0.1, 'a'), 0.2, 300, 1e-2);
  garment.material.damping = 0.01;
  garment.material.shear = 40;
  garment.material.stretch_weft = 200;
  fixtures::use_flat_rest(garment);
  for (const char* membrane : {"springs", "strain"}) {
    ClothOptions options;
    options.membrane = membrane;
    const Cloth cloth = make_cloth(garment, {}, options);
    std::vector<int> internal(cloth.mass.size());
    std::iota(internal.begin(), internal.end(), 0);
    const ElasticRows rows = make_elastic_rows(cloth, internal);
    const std::size_t n = internal.size();
    Random random{5, 0, 0};
    const auto any = [&](double size) {
      const auto one = [&] { return size * (uniform(random) - 0.5); };
      return Vec4<double>{one(), one(), one(), 0};
    };
    std::vector<Vec4<double>> x(n);
    std::vector<Vec4<double>> v(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto p = cloth.rest_positions.row(static_cast<Index>(i));
      x[i] = with_w(Vec3d{p[0], p[1], p[2]} + xyz(any(0.04)), 0.0);
      v[i] = any(1);
    }
    std::vector<Vec4<double>> scratch(rows.rows.size());
    std::vector<Vec4<double>> still(n);
    std::vector<Vec4<double>> force(n);
    elastic_forces(rows, x, std::vector<Vec4<double>>(n), scratch, still);
    elastic_forces(rows, x, v, scratch, force);
    double taken = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d damping = xyz(force[i]) - xyz(still[i]);
      taken -= dot(damping, xyz(v[i]));
      const double found[3] = {damping.x, damping.y, damping.z};
      double* const speed[3] = {&v[i].x, &v[i].y, &v[i].z};
      for (int axis = 0; axis < 3; ++axis) {
        const double step = 1e-3;  // the power is quadratic in velocities
        const double at = *speed[axis];
        *speed[axis] = at + step;
        const double high = damped_power(rows, x, v);
        *speed[axis] = at - step;
        const double low = damped_power(rows, x, v);
        *speed[axis] = at;
        EXPECT_NEAR(found[axis], -0.5 * (high - low) / (2 * step), 1e-5) << membrane << i;
      }
    }
    EXPECT_NEAR(taken / damped_power(rows, x, v), 1, 1e-6) << membrane;
  }
}

// The middle of a sheet that is held all round, sheared and stretched, is let go. Its oscillation
// of angular speed w dies at w^2 (damping + h) / 2, of which h is implicit Euler's own share.
TEST(ElasticRows, ShearedYarns_AreDampedByTheirModulus) {
  Garment garment = fixtures::garment_of(fixtures::sheet(2, 2, 0.1), 0.2, 300, 0);
  garment.material.shear = 150;
  fixtures::use_flat_rest(garment);
  ClothOptions options;
  options.membrane = "strain";
  const double h = 2e-5;
  const auto decay = [&](double damping) {
    garment.material.damping = damping;
    // The middle alone is free.
    const Cloth cloth = make_cloth(garment, {0, 1, 2, 3, 5, 6, 7, 8}, options);
    ProjectiveSolver solver(cloth, {}, projective_statics(h, 1, 30, 0));
    ClothState state = rest_state(cloth);
    // A mode by symmetry.
    state.positions(4, 0) += 1e-4;
    state.positions(4, 2) -= 1e-4;
    solver.set_state(state);
    Control floating;
    floating.gravity.setZero();
    // Peaks of the displacement, to either side.
    std::vector<double> peaks, times;
    double before = 0;
    double now = 1e-4;
    for (int i = 1; i < 2000 && peaks.size() < 5; ++i) {
      solver.advance(floating);
      const double next = solver.state().positions(4, 0) - cloth.rest_positions(4, 0);
      if (i > 2 && (now - before) * (next - now) < 0) {
        peaks.push_back(std::abs(now));
        times.push_back(i * h);
      }
      before = now;
      now = next;
    }
    const double seconds = times.back() - times.front();
    const double speed = std::numbers::pi * static_cast<double>(peaks.size() - 1) / seconds;
    return std::pair{std::log(peaks.front() / peaks.back()) / seconds, speed};
  };
  const double damping = 1e-4;
  const auto [rate, speed] = decay(damping);
  EXPECT_NEAR(rate / (0.5 * speed * speed * (damping + h)), 1, 0.05);
}

// A fold by any angle: the row is 2 sin(angle / 2), and its energy that of the hinge.
TEST(ElasticRows, Bend_MeasuresTheAngle) {
  Garment garment = fixtures::garment_of(fixtures::sheet(1, 1, 0.1, 'd'), 0.2, 300, 1e-2);
  const Cloth cloth = make_cloth(garment);
  ASSERT_EQ(cloth.hinges.size(), 1u);
  const ElasticRows rows = make_elastic_rows(cloth, {0, 1, 2, 3});
  const ElasticRow& row = rows.rows[static_cast<std::size_t>(rows.bend_begin)];
  const ClothHinge& hinge = cloth.hinges[0];
  const Eigen::Vector3d e0 = cloth.rest_positions.row(hinge.edge0).transpose();
  const Eigen::Vector3d axis =
      (cloth.rest_positions.row(hinge.edge1).transpose() - e0).normalized();
  for (const double angle : {0.0, 0.1, 1.0, 2.5}) {
    Vec3d value{};
    std::vector<Vec4<double>> x(4);
    for (int k = 0; k < 4; ++k) {
      Eigen::Vector3d p = cloth.rest_positions.row(row.particle[k]).transpose();
      if (row.particle[k] == hinge.left) {
        p = e0 + Eigen::AngleAxisd(angle, axis) * (p - e0);
      }
      x[row.particle[k]] = {p.x(), p.y(), p.z(), 0};
      value += row.weight[k] * Vec3d{p.x(), p.y(), p.z()};
    }
    EXPECT_NEAR(norm(value), 2 * std::sin(angle / 2), 1e-12) << angle;
    // The row's length changes by cos(angle / 2) of the angle.
    const double turned = 2 * std::sin(angle / 2);
    const auto pull = [&](double rest) {
      return norm(bend_force(row, rest, 0, x.data(), nullptr));
    };
    const double expected = hinge.stiffness * angle / std::cos(angle / 2);
    const double least_pull = 1e-9 * hinge.stiffness;
    if (angle < 2) {
      EXPECT_NEAR(pull(0), expected, 0.01 * expected + least_pull) << angle;
      // At rest there, or as far to the other side.
      const auto [least, most] = std::minmax({pull(turned), pull(-turned)});
      EXPECT_NEAR(least, 0, least_pull) << angle;
      EXPECT_NEAR(most, 2 * expected, 0.02 * expected + least_pull) << angle;
    }
  }
  EXPECT_EQ(row.stiffness, hinge.stiffness);
}

// Solved to the end, a step is one of implicit Euler; fewer iterations come nearer and nearer to
// it.
TEST(ProjectiveConvergence, Iterations_ComeToImplicitEuler) {
  const double size = 0.3;
  const double h = 1.0 / 240;
  const auto off = [&](double bending, int iterations) {
    const Cloth cloth = make_cloth(
        fixtures::garment_of(fixtures::sheet(5, 5, size / 5, 'a'), 0.2, 50, bending), {0, 5});
    ClothState exact = rest_state(cloth);
    ProjectiveSolver solver(cloth, {}, projective_statics(h, 1, iterations, 0));
    for (int i = 0; i < 12; ++i) {
      exact = fixtures::newton_step(cloth, exact, h);
      solver.advance({});
    }
    return (solver.state().positions - exact.positions).rowwise().norm().maxCoeff() / size;
  };
  double last = 1;
  for (const int iterations : {2, 5, 10, 100}) {
    const double found = off(0, iterations);
    EXPECT_LT(found, last) << iterations;
    last = found;
    RecordProperty("off_after_" + std::to_string(iterations), std::to_string(1e6 * found) + "e-6");
  }
  EXPECT_LT(last, 1e-8);
  // The row of a bend is of rest lengths, where the hinge has the angle of stretched triangles.
  const double with_bends = off(1e-4, 100);
  EXPECT_LT(with_bends, 1e-4);
  RecordProperty("off_with_bends", std::to_string(1e6 * with_bends) + "e-6");
}

// With steps it comes to the motion that XPBD comes to: a sheet that swings down from two corners.
TEST(ProjectiveConvergence, Steps_ComeToXpbdsAnswer) {
  const double size = 0.3;
  const Cloth cloth =
      make_cloth(fixtures::garment_of(fixtures::sheet(8, 8, size / 8, 'a'), 0.2, 50, 0), {0, 8});
  const int frames = 10;
  SolverOptions fine;
  fine.substeps = 100;
  fine.xpbd.iterations = 60;
  fine.xpbd.precision = "double";
  fine.report = false;
  ClothSolver xpbd(cloth, {}, xpbd_options(fine));
  for (int i = 0; i < frames; ++i) {
    xpbd.advance({});
  }
  double last = 1;
  for (const int substeps : {2, 8, 32}) {
    ProjectiveSolver ours(cloth, {}, projective_statics(1.0 / 60, substeps, 40, 0));
    for (int i = 0; i < frames; ++i) {
      ours.advance({});
    }
    const double off =
        (ours.state().positions - xpbd.state().positions).rowwise().norm().maxCoeff() / size;
    EXPECT_LT(off, last / 2) << substeps;
    last = off;
    RecordProperty("off_at_" + std::to_string(substeps), std::to_string(1e6 * off) + "e-6");
  }
  EXPECT_LT(last, 5e-3);
}

// Soft cloth that its weight would stretch by a quarter, in either membrane: beyond the limit it is
// thirty times as stiff.
TEST(ProjectiveStrainLimit, SoftCloth_StretchesToTheLimitOnly) {
  const Mesh mesh = fixtures::sheet(4, 30, 0.02, 'e');
  const double length = mesh.vertices.col(2).maxCoeff();
  Garment garment = fixtures::garment_of(mesh, 0.2, 2, 1e-6);
  fixtures::use_flat_rest(garment);
  const std::vector<int> top =
      fixtures::vertices_where(mesh.vertices, [](double, double, double z) { return z < 1e-9; });
  Control control;
  control.gravity = {0, 0, 9.81};
  for (const char* membrane : {"springs", "strain"}) {
    ClothOptions cloth_options;
    cloth_options.membrane = membrane;
    const Cloth cloth = make_cloth(garment, top, cloth_options);
    const auto stretch = [&](double limit) {
      SolverOptions options = projective_statics(1.0 / 60, 10, 20, 10);
      options.projective.strain_limit = limit;
      ProjectiveSolver solver(cloth, {}, options);
      const Points x = settled(solver, control, 200, 1e-4).positions;
      return x.col(2).maxCoeff() / length - 1;
    };
    EXPECT_GT(stretch(0), 0.2) << membrane;
    // Springs of the equilateral lattice lie at 30 degrees to the pull, and the strip grows
    // narrower: they stretch by two thirds of what it does.
    const double of_strip = membrane == std::string("springs") ? 1.5 : 1;
    EXPECT_NEAR(stretch(0.05), 0.05 * of_strip, 0.01) << membrane;
    // What stretches less knows no limit.
    EXPECT_NEAR(stretch(5), stretch(0), 1e-3) << membrane;
  }
}

// Two garments, the inner held by a moving body, the outer pinned: a state read back goes on with
// the same bits, with limits of strain and contact between them.
TEST(ProjectiveRestart, HeldGarments_ContinueWithTheSameBits) {
  const Mesh ball = fixtures::sphere(0.1, 12, 24);
  Garment inner = fixtures::garment_of(fixtures::sheet(8, 8, 0.02, 'a'), 0.2, 300, 1e-5);
  inner.mesh.vertices.rowwise() += Eigen::RowVector3d(-0.08, 0.102, -0.08);
  Garment outer = inner;
  outer.mesh.vertices.col(1).array() += 0.003;
  for (int corner = 0; corner < 3; ++corner) {
    Attachment held;
    held.vertex = 40 + corner;
    held.triangle = 0;
    held.barycentric = Eigen::Vector3d(0.2 + 0.1 * corner, 0.3, 0.5 - 0.1 * corner);
    held.distance = 0.002;
    inner.attachments.push_back(held);
  }
  const Cloth cloth = join_cloths({make_cloth(inner), make_cloth(outer, {0, 8})});
  SolverOptions options = projective_statics(1.0 / 60, 4, 10, 0);
  options.self_contact = true;
  options.projective.strain_limit = 0.05;
  const auto control_at = [&](int frame) {
    const auto at = [&](int f) -> Points {
      return ball.vertices.rowwise() + Eigen::RowVector3d(0.01 * std::sin(0.3 * f), 0, 0);
    };
    Control control;
    control.body_start = at(frame);
    control.body_end = at(frame + 1);
    return control;
  };
  ProjectiveSolver whole(cloth, ball.faces, options);
  ClothState middle;
  for (int i = 0; i < 16; ++i) {
    middle = i == 7 ? whole.state() : middle;
    whole.advance(control_at(i));
  }
  ProjectiveSolver again(cloth, ball.faces, options);
  again.set_state(middle);
  for (int i = 7; i < 16; ++i) {
    again.advance(control_at(i));
  }
  EXPECT_EQ(again.state().positions, whole.state().positions);
  EXPECT_EQ(again.state().velocities, whole.state().velocities);
  const ClothState end = whole.state();
  const Points body_end = control_at(15).body_end;
  for (const Attachment& held : inner.attachments) {
    const Eigen::Vector3d place = attached_position(held, body_end, ball.faces);
    EXPECT_LT((end.positions.row(held.vertex).transpose() - place).norm(), 1e-12) << held.vertex;
  }
  EXPECT_EQ(end.positions.row(81), cloth.rest_positions.row(81)) << "pinned";
}

// A cylinder whose rest angles are its own stays one; with flat ones it opens.
TEST(ProjectiveRestAngles, TemplateAngles_KeepACurvedTemplate) {
  Mesh mesh = fixtures::sheet(20, 4, 0.01, 'a');
  const double radius = 0.05;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double angle = mesh.vertices(v, 0) / radius;
    mesh.vertices.row(v) << radius * std::sin(angle), radius * std::cos(angle), mesh.vertices(v, 2);
  }
  const Garment garment = fixtures::garment_of(mesh, 0.2, 300, 1e-4);
  Control floating;
  floating.gravity.setZero();
  const auto width = [&](const char* rest_angles) {
    ClothOptions options;
    options.rest_angles = rest_angles;
    ProjectiveSolver solver(make_cloth(garment, {}, options), {},
                            projective_statics(1.0 / 60, 4, 20, 2));
    for (int i = 0; i < 60; ++i) {
      solver.advance(floating);
    }
    const Points& x = solver.state().positions;
    return (x.row(0) - x.row(20)).norm();
  };
  const double start = (mesh.vertices.row(0) - mesh.vertices.row(20)).norm();
  EXPECT_NEAR(width("template") / start, 1, 0.01);
  EXPECT_GT(width("flat"), 1.1 * start);
}

TEST(CholeskyFactor, Solution_MatchesADenseOne) {
  const int n = 300;
  Random random{2, 0, 0};
  Points positions(n, 3);
  for (int i = 0; i < n; ++i) {
    positions.row(i) << uniform(random), uniform(random), 0;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i) {
    entries.emplace_back(i, i, 0.5);
    for (int j = 0; j < i; ++j) {
      if ((positions.row(i) - positions.row(j)).norm() < 0.12) {
        const double k = uniform(random);
        entries.emplace_back(i, i, k);
        entries.emplace_back(j, j, k);
        entries.emplace_back(i, j, -k);
        entries.emplace_back(j, i, -k);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::MatrixXd dense(matrix);
  Eigen::MatrixXd right(n, 3);
  for (int i = 0; i < n; ++i) {
    right.row(i) << uniform(random), uniform(random), uniform(random);
  }
  const Eigen::MatrixXd expected = dense.llt().solve(right);
  const auto solved = [&](auto factor) {
    std::vector<Vec4<double>> x(n);
    for (int i = 0; i < n; ++i) {
      x[i] = {right(i, 0), right(i, 1), right(i, 2), 0};
    }
    factor.solve(x);
    Eigen::MatrixXd out(n, 3);
    for (int i = 0; i < n; ++i) {
      out.row(i) << x[i].x, x[i].y, x[i].z;
    }
    x.pop_back();
    EXPECT_THROW(factor.solve(x), LogicError);
    return out;
  };
  EXPECT_LT((solved(CholeskyFactor<double>(matrix, positions)) - expected).cwiseAbs().maxCoeff(),
            1e-10);
  EXPECT_LT((solved(CholeskyFactor<float>(matrix, positions)) - expected).cwiseAbs().maxCoeff(),
            1e-5);
  matrix.coeffRef(7, 7) = -1;
  EXPECT_THROW(CholeskyFactor<float>(matrix, positions), DataError);
}

// Panels of every height and width, with vectors of eight where there are some.
TEST(PanelProducts, Products_MatchPlainOnes) {
  Random random{3, 0, 0};
  for (int columns = 1; columns < 14; ++columns) {
    for (int lead : {8, 16, 40}) {
      std::vector<float> values(static_cast<std::size_t>(lead * columns));
      std::vector<float> b(static_cast<std::size_t>(3 * columns));
      std::vector<float> s(static_cast<std::size_t>(3 * lead));
      for (std::vector<float>* each : {&values, &b, &s}) {
        for (float& value : *each) {
          value = static_cast<float>(uniform(random));
        }
      }
      for (int k = 0; k < columns; ++k) {
        std::fill_n(values.data() + k * lead, std::min(k, lead), 0.0F);
      }
      std::vector<double> wide(values.begin(), values.end());
      const std::vector<double> wide_b(b.begin(), b.end());
      std::vector<double> wide_s(s.begin(), s.end());
      std::vector<float> z(b.size());
      std::vector<double> wide_z(b.size());
      transposed_product(FactorPanel<float>{values.data(), lead, columns}, s.data(), z.data());
      transposed_product(FactorPanel<double>{wide.data(), lead, columns}, wide_s.data(),
                         wide_z.data());
      add_product(FactorPanel<float>{values.data(), lead, columns}, b.data(), s.data());
      add_product(FactorPanel<double>{wide.data(), lead, columns}, wide_b.data(), wide_s.data());
      for (std::size_t i = 0; i < z.size(); ++i) {
        EXPECT_NEAR(z[i], wide_z[i], 1e-5);
      }
      for (std::size_t i = 0; i < s.size(); ++i) {
        EXPECT_NEAR(s[i], wide_s[i], 1e-5);
      }
    }
  }
}

// A factor of single precision leaves nothing that iterations do not mend: light cloth so stiff
// that its matrix is a hundred million times a mass falls as freely as any, and one that hangs,
// hangs.
TEST(ProjectiveSinglePrecision, LightStiffCloth_FallsFreely) {
  const Garment garment =
      fixtures::garment_of(fixtures::sheet(8, 8, 0.3 / 8, 'a'), 1e-3, 1e5, 1e-6);
  ProjectiveSolver falling(make_cloth(garment), {}, projective_statics(1.0 / 60, 1, 20, 0));
  ProjectiveSolver hanging(make_cloth(garment, {0, 8}), {}, projective_statics(1.0 / 60, 1, 20, 0));
  const int frames = 30;
  for (int i = 0; i < frames; ++i) {
    falling.advance({});
    hanging.advance({});
  }
  const Points v = falling.state().velocities;
  EXPECT_NEAR(v.col(1).minCoeff() / (-9.81 * frames / 60), 1, 1e-6);
  EXPECT_NEAR(v.col(1).maxCoeff() / (-9.81 * frames / 60), 1, 1e-6);
  EXPECT_LT(hanging.state().velocities.rowwise().norm().maxCoeff(), 1);
}

TEST(ProjectiveRefused, HostileValues_Throw) {
  const Cloth cloth =
      make_cloth(fixtures::garment_of(fixtures::sheet(4, 4, 0.02, 'a'), 0.2, 300, 1e-5), {0});
  const Mesh ball = fixtures::sphere(0.1, 8, 16);
  const SolverOptions good = projective_statics(1.0 / 60, 4, 10, 0);
  const auto refuses = [&](auto change) {
    SolverOptions options = good;
    change(options);
    EXPECT_THROW(ProjectiveSolver(cloth, ball.faces, options), LogicError);
  };
  refuses([](SolverOptions& o) { o.projective.iterations = 0; });
  refuses([](SolverOptions& o) { o.projective.substeps = -3; });
  refuses([](SolverOptions& o) { o.projective.acceleration = 21; });
  refuses([](SolverOptions& o) { o.time_step = std::nan(""); });
  refuses([](SolverOptions& o) { o.friction = std::numeric_limits<double>::infinity(); });
  ProjectiveSolver solver(cloth, ball.faces, good);
  ClothState state = rest_state(cloth);
  state.positions(2, 1) = std::nan("");
  EXPECT_THROW(solver.set_state(state), DataError);
  for (const double wild : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    state = rest_state(cloth);
    state.velocities(3, 2) = wild;
    try {
      solver.set_state(state);
      FAIL() << wild;
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find("vertex 3: a velocity"), std::string::npos)
          << error.what();
    }
  }
  state = rest_state(cloth);
  state.positions.conservativeResize(3, 3);
  EXPECT_THROW(solver.set_state(state), LogicError);
  // Velocities that no double can add up to a place: the frame is refused, the state stays.
  state = rest_state(cloth);
  state.velocities(3, 2) = 1e308;
  solver.set_state(state);
  EXPECT_THROW(solver.advance(fixtures::still(ball.vertices)), DataError);
  EXPECT_EQ(solver.state().positions, state.positions);
  solver.set_state(rest_state(cloth));
  Control control = fixtures::still(ball.vertices);
  control.body_end(0, 0) = std::nan("");
  EXPECT_THROW(solver.advance(control), DataError);
  control = fixtures::still(ball.vertices);
  control.body_end.col(1).array() += 3;
  EXPECT_THROW(solver.advance(control), DataError);
  control = fixtures::still(ball.vertices);
  control.gravity[0] = std::nan("");
  EXPECT_THROW(solver.advance(control), LogicError);
  EXPECT_EQ(solver.state().frame, 0);
}

// Materials over six orders of magnitude stay finite on a moving ball.
TEST(ProjectiveRobust, AnyMaterial_StaysFinite) {
  const Mesh ball = fixtures::sphere(0.1, 12, 24);
  for (const double stretch : {0.1, 100.0, 1e5}) {
    for (const double bending : {1e-9, 1e-5, 1e-3}) {
      Garment garment =
          fixtures::garment_of(fixtures::sheet(8, 8, 0.02, 'a'), 0.2, stretch, bending);
      garment.mesh.vertices.col(1).array() += 0.102;
      ProjectiveSolver solver(make_cloth(garment), ball.faces,
                              projective_statics(1.0 / 60, 4, 5, 0));
      for (int i = 0; i < 20; ++i) {
        Control control;
        const auto at = [&](int frame) -> Points {
          return ball.vertices.rowwise() + Eigen::RowVector3d(0.05 * std::sin(frame), 0, 0);
        };
        control.body_start = at(i);
        control.body_end = at(i + 1);
        ASSERT_NO_THROW(solver.advance(control)) << stretch << " " << bending;
      }
      EXPECT_LT(solver.state().velocities.rowwise().norm().maxCoeff(), 30);
    }
  }
}

}  // namespace
}  // namespace atelier
