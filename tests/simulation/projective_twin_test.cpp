// Projective dynamics on the CPU and on CUDA. Both solve an iteration in float and by other
// products, so they differ by rounding, which Anderson's acceleration, whose small system is nearly
// singular, enlarges from iteration to iteration, and contacts that begin or end and folds from
// frame to frame: changes of velocity that are noised by 1e-7 on the CPU alone move two layers
// apart by 5 mm in eight frames, a sheet on a ball by 0.3 mm. So both begin every frame where the
// CPU is, and iterate a few times: the same noise then moves the sheet by 0.13 um.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "simulation/contact/crossings.h"
#include "simulation/projective/anderson_math.h"
#include "simulation/projective/inverse_factor.h"
#include "simulation/solver.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

/// A model and what happens to it in each frame.
struct TwinScene {
  SimulationModel model;
  Mesh ball;
  Eigen::RowVector3d from{0, 0, 0};
  Eigen::RowVector3d step{0, 0, 0};
  SolverOptions options;

  TwinScene() {
    options.name = "projective-friction";
    options.projective.substeps = 3;
    options.projective.iterations = 8;
  }
  Control control(int frame) const {
    Control out;
    if (model.body_faces.rows() > 0) {
      const auto at = [&](int f) -> Points { return ball.vertices.rowwise() + (from + f * step); };
      out.body_start = at(frame);
      out.body_end = at(frame + 1);
    }
    return out;
  }
};

/// Largest distance of the two devices' vertices after any of `frames`, and that of their
/// velocities over a frame.
double twin_distance(const TwinScene& scene, int frames) {
  const std::unique_ptr<Solver> cpu = create_solver(scene.model, scene.options, Device::Cpu);
  const std::unique_ptr<Solver> cuda = create_solver(scene.model, scene.options, Device::Cuda);
  double distance = 0;
  for (int frame = 0; frame < frames; ++frame) {
    cuda->set_state(cpu->state());
    const FrameReport a = cpu->step(scene.control(frame));
    const FrameReport b = cuda->step(scene.control(frame));
    EXPECT_EQ(a.frame, b.frame);
    // A micrometre within a substep is some 1e-4 of these velocities.
    EXPECT_NEAR(a.kinetic_energy, b.kinetic_energy, 1e-4 * a.kinetic_energy + 1e-12) << frame;
    EXPECT_NEAR(a.elastic_energy, b.elastic_energy, 1e-3 * a.elastic_energy + 1e-12) << frame;
    EXPECT_NEAR(a.body_contacts, b.body_contacts, 2) << frame;
    EXPECT_EQ(a.penetrating, b.penetrating) << frame;
    const ClothState on_cpu = cpu->state();
    const ClothState on_cuda = cuda->state();
    const double velocities = (on_cpu.velocities - on_cuda.velocities).rowwise().norm().maxCoeff();
    const double positions = (on_cpu.positions - on_cuda.positions).rowwise().norm().maxCoeff();
    distance = std::max({distance, positions, velocities / 60});
  }
  ::testing::Test::RecordProperty("distance", std::to_string(1e9 * distance) + " nm");
  return distance;
}

/// A garment over the ball `radius` above its middle, with some of its vertices moved at random.
TwinScene scene_on_a_ball(int cells, const ClothOptions& cloth_options,
                          const std::vector<int>& pins, double damping, std::uint64_t seed) {
  TwinScene out;
  Garment garment =
      fixtures::garment_of(fixtures::sheet(cells, cells, 0.3 / cells, 'a'), 0.2, 300, 1e-5);
  fixtures::use_flat_rest(garment);
  garment.material.damping = damping;
  garment.material.friction = 0.4;
  Random random{seed, 0, 0};
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      garment.mesh.vertices(v, axis) += 0.1 / cells * (uniform(random) - 0.5);
    }
  }
  out.model.cloth = make_cloth(garment, pins, cloth_options);
  out.ball = fixtures::sphere(0.1, 16, 24);
  out.model.body_faces = out.ball.faces;
  out.from = {0.14, -0.106, 0.15};
  out.step = {0.004, 0.001, -0.002};
  return out;
}

class ProjectiveTwins : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!cuda_available()) {
      GTEST_SKIP() << "no CUDA device on this machine";
    }
  }
};

TEST_F(ProjectiveTwins, ClothOnAMovingBall_Agrees) {
  for (const char* membrane : {"springs", "strain"}) {
    for (const double damping : {0.0, 0.002}) {
      for (const int acceleration : {0, 5, 20}) {
        ClothOptions cloth_options;
        cloth_options.membrane = membrane;
        cloth_options.tether_stretch = 1.1;
        TwinScene scene = scene_on_a_ball(20, cloth_options, {0, 20}, damping, 1);
        scene.options.projective.acceleration = acceleration;
        EXPECT_LT(twin_distance(scene, 8), 1e-6) << membrane << damping << acceleration;
      }
    }
  }
}

// Without acceleration: with it, what begins or ends to be beyond the limit turns noise of 0.1 nm
// in the positions into 0.1 mm after a frame, on the CPU alone; without into 5 nm.
TEST_F(ProjectiveTwins, StretchBeyondTheLimit_Agrees) {
  for (const char* membrane : {"springs", "strain"}) {
    for (const double damping : {0.0, 0.002}) {
      ClothOptions cloth_options;
      cloth_options.membrane = membrane;
      TwinScene scene = scene_on_a_ball(20, cloth_options, {0, 20}, damping, 1);
      scene.options.projective.acceleration = 0;
      const auto end = [&](double limit) {
        scene.options.projective.strain_limit = limit;
        const std::unique_ptr<Solver> solver =
            create_solver(scene.model, scene.options, Device::Cuda);
        for (int frame = 0; frame < 8; ++frame) {
          solver->step(scene.control(frame));
        }
        return solver->state().positions;
      };
      constexpr double kLimit = 0.01;
      EXPECT_GT((end(0) - end(kLimit)).rowwise().norm().maxCoeff(), 1e-4) << membrane;
      scene.options.projective.strain_limit = kLimit;
      EXPECT_LT(twin_distance(scene, 8), 1e-6) << membrane << damping;
    }
  }
}

// Springs between points anywhere, one of them alone, some fixed.
TEST_F(ProjectiveTwins, RandomNets_Agree) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Random random{seed, 1, 0};
    const int n = 40 + static_cast<int>(300 * uniform(random));
    Points x(n, 3);
    std::vector<double> mass;
    std::vector<ClothSpring> springs;
    for (int i = 0; i < n; ++i) {
      x.row(i) << uniform(random), uniform(random), uniform(random);
      mass.push_back(0.001 + 0.01 * uniform(random));
      for (int k = 0; k < 3 && i > 1; ++k) {
        const int other = static_cast<int>((i - 1) * uniform(random));
        springs.push_back({other, i,
                           (x.row(i) - x.row(other)).norm() * (0.8 + 0.4 * uniform(random)),
                           std::pow(10.0, 4 * uniform(random))});
      }
    }
    TwinScene scene;
    scene.model.cloth = make_spring_net(x, mass, springs, {0, n / 2});
    scene.options.projective.iterations = 20;
    scene.options.projective.acceleration = 0;
    EXPECT_LT(twin_distance(scene, 5), 1e-6) << seed;
    scene.options.projective.iterations = 8;
    scene.options.projective.acceleration = 5;
    EXPECT_LT(twin_distance(scene, 5), 1e-6) << seed;
  }
}

TEST_F(ProjectiveTwins, SeveralSewnGarments_Agree) {
  Garment lower = fixtures::garment_of(fixtures::sheet(6, 4, 0.03), 0.1, 500, 1e-5);
  const Index half = lower.mesh.vertices.rows();
  const Index faces = lower.mesh.faces.rows();
  Points panel = lower.mesh.vertices;
  lower.mesh.vertices.resize(2 * half, 3);
  lower.mesh.vertices << panel, panel.rowwise() + Eigen::RowVector3d(0, 0, -0.15);
  lower.mesh.faces.conservativeResize(2 * faces, 3);
  lower.mesh.faces.bottomRows(faces) =
      lower.mesh.faces.topRows(faces).array() + static_cast<int>(half);
  Seam seam{"side", {}, {}};
  for (int c = 0; c <= 6; ++c) {
    seam.a.push_back(c);
    seam.b.push_back(static_cast<int>(half) + 4 * 7 + c);
  }
  lower.seams = {seam};
  Garment upper = fixtures::garment_of(fixtures::sheet(7, 7, 0.025, 'a'), 0.3, 200, 1e-4);
  upper.mesh.vertices.col(1).array() += 0.05;
  ClothOptions sewn;
  sewn.seam_stiffness = 200;
  TwinScene scene;
  scene.model.cloth = join_cloths({make_cloth(lower, {0, 6}, sewn), make_cloth(upper)});
  EXPECT_LT(twin_distance(scene, 10), 1e-6);
}

/// Two layers over the scene's ball, each vertex moved at random by up to `noise` m.
TwinScene layers_on_a_ball(int cells, double noise, std::uint64_t seed) {
  TwinScene scene;
  Random random{seed, 2, 0};
  std::vector<Cloth> layers;
  for (int k = 0; k < 2; ++k) {
    Garment garment =
        fixtures::garment_of(fixtures::sheet(cells, cells, 0.288 / cells, 'a'), 0.2, 300, 1e-5);
    garment.material.thickness = 1e-3;
    garment.mesh.vertices.rowwise() += Eigen::RowVector3d(-0.144, 0.102, -0.144);
    garment.mesh.vertices.rowwise() += k * Eigen::RowVector3d(0.005, 0.0025, 0.002);
    for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
      for (int axis = 0; axis < 3; ++axis) {
        garment.mesh.vertices(v, axis) += noise * uniform(random, -1, 1);
      }
    }
    layers.push_back(make_cloth(garment));
  }
  scene.model.cloth = join_cloths(layers);
  scene.ball = fixtures::sphere(0.1, 16, 24);
  scene.model.body_faces = scene.ball.faces;
  scene.step = {0.004, 0, 0};
  scene.options.self_contact = true;
  scene.options.friction = uniform(random, 0.2, 0.8);
  scene.options.self_friction = uniform(random, 0.1, 0.8);
  return scene;
}

// Contacts between pieces of cloth are solved one after the other on the CPU and all at once on
// CUDA: both come to Coulomb's law. A sheet anywhere on another, turned and uneven, that leans at
// random: nothing here enlarges what they differ by, as folds do.
struct LeaningStack {
  TwinScene scene;
  Control control;
  Index upper;      ///< vertices of the upper sheet, which come last
  double slope;     ///< rad
  double on_cloth;  ///< friction
};
LeaningStack leaning_stack(std::uint64_t seed) {
  Random random{seed, 3, 0};
  LeaningStack out;
  const auto laid = [&](int cells, double size, double height) {
    Mesh mesh = fixtures::sheet(cells, cells, size / cells, 'a');
    const double turn = uniform(random, 0, 6.28);
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      const double x = mesh.vertices(v, 0) - size / 2 + 0.2 * size / cells * uniform(random, -1, 1);
      const double z = mesh.vertices(v, 2) - size / 2 + 0.2 * size / cells * uniform(random, -1, 1);
      mesh.vertices.row(v) << std::cos(turn) * x - std::sin(turn) * z, height,
          std::sin(turn) * x + std::cos(turn) * z;
    }
    Garment garment = fixtures::garment_of(mesh, uniform(random, 0.1, 0.3), 500, 1e-4);
    garment.material.thickness = 1e-3;
    return make_cloth(garment);
  };
  const Cloth lower = laid(10, 0.4, 1e-3);
  const Cloth upper = laid(4, uniform(random, 0.08, 0.15), 2e-3);
  out.upper = upper.rest_positions.rows();
  out.scene.model.cloth = join_cloths({lower, upper});
  out.scene.ball = fixtures::incline(0, 20);  // gravity leans instead
  out.scene.model.body_faces = out.scene.ball.faces;
  SolverOptions& options = out.scene.options;
  options.time_step = 0.01;
  options.projective.substeps = 20;
  options.projective.iterations = 20;
  options.self_contact = true;
  out.slope = uniform(random, 0.5, 0.9);
  options.friction = 2;
  out.on_cloth = options.self_friction = uniform(random, 0, 1.2 * std::tan(out.slope));
  out.control = out.scene.control(0);
  out.control.body_end = out.control.body_start;
  const double heading = uniform(random, 0, 6.28);
  out.control.gravity =
      9.81 * Eigen::Vector3d(std::sin(out.slope) * std::cos(heading), -std::cos(out.slope),
                             std::sin(out.slope) * std::sin(heading));
  return out;
}

TEST_F(ProjectiveTwins, RandomStacks_SlideByCoulombsLawOnBoth) {
  constexpr int kFrames = 10;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const LeaningStack stack = leaning_stack(seed);
    std::vector<ClothState> ends;
    for (const Device device : {Device::Cpu, Device::Cuda}) {
      const std::unique_ptr<Solver> solver =
          create_solver(stack.scene.model, stack.scene.options, device);
      for (int i = 0; i < kFrames; ++i) {
        solver->step(stack.control);
      }
      ends.push_back(solver->state());
      const Eigen::RowVector3d mean =
          ends.back().velocities.bottomRows(stack.upper).colwise().mean();
      const double seconds = kFrames * stack.scene.options.time_step;
      const double expected = std::max(
          0.0, 9.81 * (std::sin(stack.slope) - stack.on_cloth * std::cos(stack.slope)) * seconds);
      EXPECT_NEAR(mean.norm(), expected, 1e-3 * 9.81 * seconds)
          << seed << " on " << device_name(device);
    }
    const double distance = (ends[0].positions - ends[1].positions).rowwise().norm().maxCoeff();
    EXPECT_LT(distance, 1e-5) << seed;
    RecordProperty("um_" + std::to_string(seed), std::to_string(1e6 * distance));
  }
}

TEST_F(ProjectiveTwins, LayersThatMeet_StayApartOnBoth) {
  TwinScene scene = layers_on_a_ball(24, 0, 4);
  for (const bool with_body : {true, false}) {
    scene.model.body_faces = with_body ? scene.ball.faces : Triangles();
    for (const Device device : {Device::Cpu, Device::Cuda}) {
      const std::unique_ptr<Solver> solver = create_solver(scene.model, scene.options, device);
      for (int frame = 0; frame < 20; ++frame) {
        EXPECT_LT(solver->step(scene.control(frame)).penetration_depth, 1e-4) << with_body << frame;
      }
      EXPECT_EQ(count_crossings(solver->state().positions, scene.model.cloth.faces), 0)
          << with_body;
    }
  }
}

// Springs pull particles down one wall of a groove and through the other, whose walls close: they
// have a contact with each, and such substeps take more iterations.
TEST_F(ProjectiveTwins, ParticlesInAClosingGroove_Agree) {
  TwinScene scene;
  scene.ball.vertices.resize(6, 3);
  scene.ball.vertices << -1, 1, -1, -1, 1, 1, 0, 0, -1, 0, 0, 1, 1, 1, -1, 1, 1, 1;
  scene.ball.faces.resize(4, 3);
  scene.ball.faces << 0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4;
  Random random{1, 4, 0};
  constexpr int kPairs = 40;
  Points x(2 * kPairs, 3);
  std::vector<ClothSpring> springs;
  std::vector<int> held;
  for (int k = 0; k < kPairs; ++k) {
    const double across = uniform(random, 0.01, 0.03);
    x.row(2 * k) << 0.03, -0.05, 0.02 * k - 0.4;
    x.row(2 * k + 1) << -across, across + 0.0015, 0.02 * k - 0.4;
    springs.push_back({2 * k, 2 * k + 1, 0.01, uniform(random, 200, 2000)});
    if (k > 0) {
      springs.push_back({2 * k - 1, 2 * k + 1, 0.02, 20});
    }
    held.push_back(2 * k);
  }
  scene.model.cloth = make_spring_net(x, std::vector<double>(x.rows(), 0.001), springs, held);
  scene.model.body_faces = scene.ball.faces;
  scene.options.thickness = 1e-3;
  scene.options.projective.acceleration = 0;
  for (const double friction : {0.0, 0.3}) {
    scene.options.friction = friction;
    const std::unique_ptr<Solver> cpu = create_solver(scene.model, scene.options, Device::Cpu);
    const std::unique_ptr<Solver> cuda = create_solver(scene.model, scene.options, Device::Cuda);
    double distance = 0;
    for (int frame = 0; frame < 10; ++frame) {
      const auto at = [&](int f) {
        Points p = scene.ball.vertices;
        p.col(0) *= 1 - 0.01 * f;
        return p;
      };
      Control control;
      control.body_start = at(frame);
      control.body_end = at(frame + 1);
      cuda->set_state(cpu->state());
      cpu->step(control);
      cuda->step(control);
      const Points apart = cpu->state().positions - cuda->state().positions;
      distance = std::max(distance, apart.rowwise().norm().maxCoeff());
    }
    EXPECT_LT(distance, 1e-6) << friction;
    RecordProperty("nm_with_" + std::to_string(friction), std::to_string(1e9 * distance));
  }
}

// Light, stiff cloth, whose matrix is far more than thirty thousand times a particle's mass.
TEST_F(ProjectiveTwins, StiffLightCloth_IsHeldGentlyOnBoth) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    TwinScene scene = scene_on_a_ball(14, {}, {}, 0, seed);
    scene.options.projective.acceleration = 0;  // which enlarges rounding to tenths of a millimetre
    for (double& mass : scene.model.cloth.mass) {
      mass *= 0.05;
    }
    for (ClothSpring& spring : scene.model.cloth.springs) {
      spring.stiffness *= 30;
    }
    EXPECT_LT(twin_distance(scene, 8), 2e-6) << seed;
  }
}

// Acceleration enlarges what half precision rounds, as it does all noise, but to cloth that is as
// far from the solution as before.
TEST_F(ProjectiveTwins, HalfPrecision_IsAsNearTheSolutionAsFloat) {
  for (const char* const membrane : {"springs", "strain"}) {
    ClothOptions cloth_options;
    cloth_options.membrane = membrane;
    TwinScene scene = scene_on_a_ball(20, cloth_options, {0, 20}, 0.001, 1);
    scene.from = {10, 10, 10};  // contacts would begin and end in other iterations
    const auto solver_of = [&](int iterations, bool half, Device device) {
      scene.options.projective.iterations = iterations;
      scene.options.projective.half_precision = half;
      return create_solver(scene.model, scene.options, device);
    };
    const std::unique_ptr<Solver> solved = solver_of(2000, false, Device::Cpu);
    // By iterations, over the frames: what either rounds in one is luck.
    std::map<int, double> of_half;
    std::map<int, double> of_float;
    for (int frame = 0; frame < 6; ++frame) {
      const ClothState start = solved->state();
      solved->step(scene.control(frame));
      const auto distance = [&](int iterations, bool half) {
        const std::unique_ptr<Solver> solver = solver_of(iterations, half, Device::Cuda);
        solver->set_state(start);
        solver->step(scene.control(frame));
        return (solver->state().positions - solved->state().positions).norm();
      };
      for (const int iterations : {8, 20, 60}) {
        of_half[iterations] += distance(iterations, true);
        of_float[iterations] += distance(iterations, false);
      }
    }
    for (const auto& [iterations, distance] : of_float) {
      EXPECT_LT(of_half[iterations], 1.2 * distance + 1e-6) << membrane << iterations;
      RecordProperty(cloth_options.membrane + std::to_string(iterations),
                     std::to_string(of_half[iterations] / distance));
    }
  }
}

/// A frame or two of every kernel, for as long as a sanitizer has patience.
TEST_F(ProjectiveTwins, ShortFrames_Agree) {
  for (const char* membrane : {"springs", "strain"}) {
    for (const bool self : {false, true}) {
      ClothOptions cloth_options;
      cloth_options.membrane = membrane;
      cloth_options.tether_stretch = 1.1;
      TwinScene scene = scene_on_a_ball(7, cloth_options, {0, 7}, 0.001, 2);
      scene.options.projective.substeps = 2;
      scene.options.projective.iterations = 3;
      scene.options.projective.acceleration = 2;
      scene.options.projective.half_precision = self;
      if (!self) {
        EXPECT_LT(twin_distance(scene, 3), 1e-6) << membrane;
        continue;
      }
      scene.options.self_contact = true;
      const std::unique_ptr<Solver> solver =
          create_solver(scene.model, scene.options, Device::Cuda);
      for (int frame = 0; frame < 3; ++frame) {
        EXPECT_LT(solver->step(scene.control(frame)).penetration_depth, 1e-4) << membrane << frame;
      }
    }
  }
}

TEST_F(ProjectiveTwins, ShortLayers_StayApart) {
  TwinScene scene = layers_on_a_ball(7, 2e-4, 5);
  scene.options.projective.substeps = 2;
  scene.options.projective.iterations = 3;
  const std::unique_ptr<Solver> solver = create_solver(scene.model, scene.options, Device::Cuda);
  for (int frame = 0; frame < 4; ++frame) {
    EXPECT_LT(solver->step(scene.control(frame)).penetration_depth, 1e-4) << frame;
  }
  EXPECT_EQ(count_crossings(solver->state().positions, scene.model.cloth.faces), 0);
}

TEST_F(ProjectiveTwins, Repeats_GiveTheSameBits) {
  for (const int layers : {0, 1, 2, 3}) {
    TwinScene scene = layers == 2 ? layers_on_a_ball(24, 2e-4, 6)
                                  : scene_on_a_ball(40, ClothOptions{}, {0}, 1e-4, 3);
    scene.options.self_contact = layers > 0;
    scene.options.projective.half_precision = layers == 3;
    ClothState first;
    for (int repeat = 0; repeat < 3; ++repeat) {
      const std::unique_ptr<Solver> solver =
          create_solver(scene.model, scene.options, Device::Cuda);
      for (int frame = 0; frame < 10; ++frame) {
        solver->step(scene.control(frame));
      }
      const ClothState state = solver->state();
      first = repeat == 0 ? state : first;
      EXPECT_EQ(state.positions, first.positions) << layers << repeat;
      EXPECT_EQ(state.velocities, first.velocities) << layers << repeat;
    }
  }
}

TEST_F(ProjectiveTwins, AllPinned_FollowTheirTargets) {
  TwinScene scene;
  const Garment garment = fixtures::garment_of(fixtures::sheet(2, 2, 0.1, 'a'), 0.2, 300, 1e-5);
  scene.model.cloth = make_cloth(garment, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  const std::unique_ptr<Solver> solver = create_solver(scene.model, scene.options, Device::Cuda);
  Control control;
  control.pin_targets = garment.mesh.vertices.rowwise() + Eigen::RowVector3d(0.01, 0.02, 0);
  solver->step(control);
  EXPECT_LT((solver->state().positions - control.pin_targets).rowwise().norm().maxCoeff(), 1e-12);
}

TEST_F(ProjectiveTwins, NotFinite_IsNamedAndUndone) {
  TwinScene scene = scene_on_a_ball(10, {}, {}, 0, 4);
  const std::unique_ptr<Solver> solver = create_solver(scene.model, scene.options, Device::Cuda);
  solver->step(scene.control(0));
  ClothState wild = solver->state();
  wild.velocities(5, 1) = 1e308;
  solver->set_state(wild);
  for (int repeat = 0; repeat < 2; ++repeat) {
    EXPECT_THROW(solver->step(scene.control(1)), DataError);
    EXPECT_EQ(solver->state().positions, wild.positions);
    EXPECT_EQ(solver->state().velocities, wild.velocities);
    EXPECT_EQ(solver->state().frame, 1);
  }
}

TEST(ProjectiveCuda, NoDevice_IsRefused) {
  if (cuda_available()) {
    GTEST_SKIP() << "there is a CUDA device";
  }
  const TwinScene scene = scene_on_a_ball(4, {}, {}, 0, 5);
  EXPECT_THROW(create_solver(scene.model, scene.options, Device::Cuda), EnvironmentError);
}

/// A matrix of unknowns in a square that are coupled where they are near.
Eigen::SparseMatrix<double> near_matrix(const Points& positions, Random& random) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < positions.rows(); ++i) {
    entries.emplace_back(i, i, 0.5);
    for (int j = 0; j < i; ++j) {
      if ((positions.row(i) - positions.row(j)).norm() < 0.1) {
        const double k = uniform(random);
        entries.emplace_back(i, i, k);
        entries.emplace_back(j, j, k);
        entries.emplace_back(i, j, -k);
        entries.emplace_back(j, i, -k);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(positions.rows(), positions.rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST(InverseFactor, ItsSquare_IsTheInverse) {
  for (const int n : {1, 20, 33, 500}) {
    Random random{3, static_cast<std::uint64_t>(n), 0};
    Points positions(n, 3);
    for (int i = 0; i < n; ++i) {
      positions.row(i) << uniform(random), uniform(random), 0;
    }
    const Eigen::SparseMatrix<double> matrix = near_matrix(positions, random);
    const InverseFactor factor(matrix, positions);
    ASSERT_EQ(factor.size(), n);
    Eigen::MatrixXd w = Eigen::MatrixXd::Zero(n, n);
    std::size_t stored = 0;
    for (const InverseFactor::Part& part : factor.parts()) {
      EXPECT_TRUE(part.parent == -1 || factor.parts()[part.parent].first <= part.first);
      for (int i = part.begin; i < part.end; ++i) {
        for (int c = 0; c < part.stride; ++c) {
          const double value = factor.values()[static_cast<std::size_t>(part.row(i) + c)];
          const int column = part.column + c;
          ASSERT_TRUE(value == 0 || (column >= part.first && column <= i));
          if (column < n) {
            w(i, column) = value;
          }
          ++stored;
        }
      }
    }
    EXPECT_EQ(stored, factor.values().size());
    const Eigen::MatrixXd inverse = Eigen::MatrixXd(matrix).inverse();
    const Eigen::MatrixXd square = w.transpose() * w;
    double off = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        off = std::max(off, std::abs(square(i, j) - inverse(factor.order()[i], factor.order()[j])));
      }
    }
    EXPECT_LT(off, 1e-11) << n;
  }
}

/// `value` with the 11 bits of half precision.
double in_half(double value) {
  int exponent = 0;
  const double fraction = std::frexp(value, &exponent);
  return std::ldexp(std::round(std::ldexp(fraction, 11)), exponent - 11);
}

TEST(InverseFactor, HalfPrecisionWhereItServes_IsWithinFourPercentInEnergy) {
  Random random{5, 0, 0};
  const int n = 500;
  Points positions(n, 3);
  for (int i = 0; i < n; ++i) {
    positions.row(i) << uniform(random), uniform(random), 0;
  }
  Eigen::SparseMatrix<double> stiffness = near_matrix(positions, random);
  const double most = stiffness.diagonal().maxCoeff();
  for (const double contrast : {1e2, 1e4, 9e4}) {
    Eigen::SparseMatrix<double> matrix = contrast / most * stiffness;
    const std::vector<double> mass(static_cast<std::size_t>(n), 1.0);
    for (int i = 0; i < n; ++i) {
      matrix.coeffRef(i, i) += 1 - 0.5 * contrast / most;  // near_matrix has 0.5 of its own
    }
    ASSERT_TRUE(half_precision_serves(matrix, mass)) << contrast;
    EXPECT_FALSE(half_precision_serves(2e5 / contrast * matrix, mass));
    const InverseFactor factor(matrix, positions);
    Eigen::MatrixXd w = Eigen::MatrixXd::Zero(n, n);
    for (const InverseFactor::Part& part : factor.parts()) {
      for (int i = part.begin; i < part.end; ++i) {
        for (int c = part.column; c <= i; ++c) {
          w(i, c) =
              in_half(factor.values()[static_cast<std::size_t>(part.row(i) + c - part.column)]);
        }
      }
    }
    Eigen::MatrixXd ordered(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        ordered(i, j) = matrix.coeff(factor.order()[i], factor.order()[j]);
      }
    }
    // Of the inverse as the matrix's own energy sees it: 1 everywhere, where it is exact.
    const Eigen::MatrixXd lower = ordered.llt().matrixL();
    const Eigen::MatrixXd product = w * lower;
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(product.transpose() * product).eigenvalues();
    EXPECT_GT(values.minCoeff(), 0.96) << contrast;
    EXPECT_LT(values.maxCoeff(), 1.04) << contrast;
  }
}

TEST(InverseFactor, AnyThreadCount_GivesTheSameBits) {
  Random random{4, 0, 0};
  Points positions(700, 3);
  for (int i = 0; i < 700; ++i) {
    positions.row(i) << uniform(random), uniform(random), 0;
  }
  const Eigen::SparseMatrix<double> matrix = near_matrix(positions, random);
  set_thread_count(1);
  const InverseFactor one(matrix, positions);
  set_thread_count(5);
  const InverseFactor five(matrix, positions);
  set_thread_count(0);
  EXPECT_EQ(one.values(), five.values());
  EXPECT_EQ(one.order(), five.order());
}

TEST(InverseFactor, IndefiniteMatrix_IsRefused) {
  Eigen::SparseMatrix<double> matrix(2, 2);
  matrix.insert(0, 0) = 1;
  matrix.insert(1, 1) = -1;
  EXPECT_THROW(InverseFactor(matrix, Points::Zero(2, 3)), DataError);
  EXPECT_EQ(InverseFactor(Eigen::SparseMatrix<double>(0, 0), Points(0, 3)).size(), 0);
}

TEST(AndersonMath, SymmetricSystems_AreSolved) {
  for (int n = 1; n <= 20; ++n) {
    Random random{5, static_cast<std::uint64_t>(n), 0};
    Eigen::MatrixXd half(n, n);
    Eigen::VectorXd right(n);
    for (int i = 0; i < n; ++i) {
      right[i] = uniform(random, -1, 1);
      for (int j = 0; j < n; ++j) {
        half(i, j) = uniform(random, -1, 1);
      }
    }
    const Eigen::MatrixXd matrix = half * half.transpose() + 0.01 * Eigen::MatrixXd::Identity(n, n);
    Eigen::MatrixXd used = matrix;
    Eigen::VectorXd found = right;
    EXPECT_TRUE(solve_symmetric(used.data(), found.data(), n, AloneInRows{}));
    EXPECT_LT((matrix * found - right).norm(), 1e-9) << n;
  }
  double none[4] = {0, 0, 0, 2};
  double right[2] = {1, 4};
  EXPECT_TRUE(solve_symmetric(none, right, 2, AloneInRows{}));
  EXPECT_EQ(right[0], 0);
  EXPECT_EQ(right[1], 2);
  double infinite[1] = {1e-200};
  double large[1] = {1e200};
  EXPECT_FALSE(solve_symmetric(infinite, large, 1, AloneInRows{}));
}

}  // namespace
}  // namespace atelier
