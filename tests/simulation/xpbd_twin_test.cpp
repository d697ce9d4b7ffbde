#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/tree.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

#define SKIP_WITHOUT_CUDA()                           \
  if (!cuda_available()) {                            \
    GTEST_SKIP() << "no CUDA device on this machine"; \
  }

/// How blocks can wait for each other on this device. Clusters are refused in words where the
/// device or the build has none.
std::vector<std::string> barriers() {
  std::vector<std::string> out{"block", "grid", "graph"};
  XpbdOptions options;
  options.cuda_barrier = "cluster";
  try {
    const Garment garment = fixtures::garment_of(fixtures::sheet(2, 2, 0.1, 'a'), 0.2, 300, 1e-5);
    const ClothSolver solver(make_cloth(garment, {0}), {}, options, Device::Cuda);
    out.push_back("cluster");
  } catch (const EnvironmentError& e) {
    EXPECT_NE(std::string(e.what()).find("clusters"), std::string::npos) << e.what();
  }
  return out;
}

/// A sheet with every kind of constraint falling on a moving ball.
struct Scene {
  Cloth cloth;
  Mesh ball;
  Control control(int frame) const {
    Control out;
    const auto at = [&](int f) -> Points {
      return ball.vertices.rowwise() + Eigen::RowVector3d(0.05 * std::sin(0.1 * f), -0.25, 0);
    };
    out.body_start = at(frame);
    out.body_end = at(frame + 1);
    return out;
  }
};

Scene scene(const std::string& membrane, double damping) {
  Scene out;
  Garment garment = fixtures::garment_of(fixtures::sheet(30, 30, 0.02, 'a'), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(0).array() -= 0.3;
  garment.mesh.vertices.col(2).array() -= 0.3;
  fixtures::use_flat_rest(garment);
  garment.material.damping = damping;
  ClothOptions options;
  options.membrane = membrane;
  options.tether_stretch = 1.1;
  options.schedule.patches = 6;
  out.cloth = make_cloth(garment, {0, 30}, options);
  out.ball = fixtures::sphere(0.15, 24, 48);
  return out;
}

TEST(Twins, CpuAndCuda_AgreeOverAFewFrames) {
  SKIP_WITHOUT_CUDA();
  for (const char* precision : {"double", "float"}) {
    for (const char* membrane : {"springs", "strain"}) {
      for (double damping : {0.0, 0.002}) {
        for (int iterations : {1, 3}) {
          const Scene s = scene(membrane, damping);
          XpbdOptions options;
          options.precision = precision;
          options.iterations = iterations;
          options.vectors = "scalar";
          ClothSolver cpu(s.cloth, s.ball.faces, options);
          ClothSolver cuda(s.cloth, s.ball.faces, options, Device::Cuda);
          for (int i = 0; i < 8; ++i) {
            const FrameReport a = cpu.advance(s.control(i));
            const FrameReport b = cuda.advance(s.control(i));
            EXPECT_NEAR(a.kinetic_energy, b.kinetic_energy, 1e-3 * a.kinetic_energy + 1e-9);
            EXPECT_NEAR(a.body_contacts, b.body_contacts, 3);
            // In float C + a' lambda is a difference of what nearly cancels.
            EXPECT_NEAR(a.strain_residual, b.strain_residual,
                        precision[0] == 'd' ? 1e-9 : 1e-3 * std::abs(a.strain_residual) + 1e-6);
            EXPECT_EQ(a.strain_residual >= 0, membrane == std::string("strain"));
          }
          const double difference =
              (cpu.state().positions - cuda.state().positions).rowwise().norm().maxCoeff();
          // Contact switches grow rounding; before they do it is rounding.
          EXPECT_LT(difference, precision[0] == 'd' ? 1e-9 : 2e-4)
              << precision << membrane << damping << iterations;
        }
      }
    }
  }
}

TEST(Twins, VectorAndScalarCode_Agree) {
  const Scene probe = scene("springs", 0);
  XpbdOptions wants;
  wants.vectors = "avx2";
  try {
    const ClothSolver solver(probe.cloth, {}, wants);
  } catch (const EnvironmentError&) {
    GTEST_SKIP() << "no AVX2 on this machine";
  }
  for (double damping : {0.0, 0.002}) {
    for (int iterations : {1, 3}) {
      const Scene s = scene("springs", damping);
      std::vector<ClothState> states;
      for (const char* vectors : {"avx2", "scalar"}) {
        XpbdOptions options;
        options.vectors = vectors;
        options.iterations = iterations;
        ClothSolver solver(s.cloth, {}, options);
        for (int i = 0; i < 8; ++i) {
          solver.advance({});
        }
        states.push_back(solver.state());
      }
      EXPECT_LT((states[0].positions - states[1].positions).rowwise().norm().maxCoeff(), 2e-5)
          << damping << iterations;
      EXPECT_GT((states[0].positions - s.cloth.rest_positions).rowwise().norm().maxCoeff(), 0.05);
    }
  }
}

TEST(Twins, CpuAndCudaJacobi_Agree) {
  SKIP_WITHOUT_CUDA();
  for (const char* membrane : {"springs", "strain"}) {
    const Scene s = scene(membrane, 0.001);
    XpbdOptions options;
    options.precision = "double";
    options.sweep = "jacobi";
    options.iterations = 5;
    ClothSolver cpu(s.cloth, s.ball.faces, options);
    ClothSolver cuda(s.cloth, s.ball.faces, options, Device::Cuda);
    for (int i = 0; i < 5; ++i) {
      cpu.advance(s.control(i));
      cuda.advance(s.control(i));
    }
    EXPECT_LT((cpu.state().positions - cuda.state().positions).rowwise().norm().maxCoeff(), 1e-9)
        << membrane;
  }
}

/// Both sweeps solve the same equations: with enough iterations they meet, and acceleration gets
/// there sooner.
TEST(Jacobi, ManyIterations_ConvergeToGaussSeidel) {
  for (const char* membrane : {"springs", "strain"}) {
    const Scene s = scene(membrane, 0.001);
    const auto after = [&](const std::string& sweep, int iterations, double radius) {
      XpbdOptions options;
      options.precision = "double";
      options.sweep = sweep;
      options.iterations = iterations;
      options.jacobi_radius = radius;
      options.report = true;
      ClothSolver solver(s.cloth, {}, options);
      solver.advance({});
      return solver.state().positions;
    };
    const Points exact = after("gauss-seidel", 300, 0);
    const auto error = [&](const Points& x) { return (x - exact).rowwise().norm().maxCoeff(); };
    const double plain = error(after("jacobi", 60, 0));
    const double accelerated = error(after("jacobi", 60, 0.95));
    const double moved = (exact - s.cloth.rest_positions).rowwise().norm().maxCoeff();
    EXPECT_GT(moved, 1e-3);
    EXPECT_LT(accelerated, 0.75 * plain) << membrane;
    EXPECT_LT(error(after("jacobi", 600, 0.95)), 2e-3 * moved) << membrane;
  }
}

TEST(Jacobi, AnyThreadCount_GivesTheSameBits) {
  const Scene s = scene("strain", 0.001);
  XpbdOptions options;
  options.sweep = "jacobi";
  options.iterations = 4;
  for (Device device : fixtures::devices()) {
    Points reference;
    for (int threads : {0, 1}) {
      set_thread_count(threads);
      ClothSolver solver(s.cloth, s.ball.faces, options, device);
      for (int i = 0; i < 5; ++i) {
        solver.advance(s.control(i));
      }
      if (threads == 0) {
        reference = solver.state().positions;
      }
      EXPECT_EQ(solver.state().positions, reference) << device_name(device);
    }
    set_thread_count(0);
  }
}

/// Every kind of launch, for as long as a sanitizer has patience: a frame of a small sheet.
TEST(Twins, ShortFramesOfEveryKind_Agree) {
  SKIP_WITHOUT_CUDA();
  Garment garment = fixtures::garment_of(fixtures::sheet(6, 6, 0.05, 'a'), 0.2, 300, 1e-5);
  fixtures::use_flat_rest(garment);
  const Mesh ball = fixtures::sphere(0.15, 8, 12);
  Control control;
  control.body_start = ball.vertices.rowwise() + Eigen::RowVector3d(0.15, -0.152, 0.15);
  control.body_end = control.body_start;
  for (const char* membrane : {"springs", "strain"}) {
    ClothOptions cloth_options;
    cloth_options.membrane = membrane;
    cloth_options.tether_stretch = 1.1;
    cloth_options.schedule.patches = 4;
    const Cloth cloth = make_cloth(garment, {0, 6}, cloth_options);
    std::vector<std::string> ways = barriers();
    ways.push_back("jacobi");
    for (const std::string& way : ways) {
      for (bool contacts : {false, true}) {
        XpbdOptions options;
        options.precision = "double";
        options.substeps = 2;
        options.iterations = 2;
        options.self_contact = contacts;
        if (way == "jacobi") {
          options.sweep = way;
          options.self_contact = false;  // refused on CUDA
        } else {
          options.cuda_barrier = way;
        }
        const Triangles faces = contacts ? ball.faces : Triangles();
        ClothSolver cpu(cloth, faces, options);
        ClothSolver cuda(cloth, faces, options, Device::Cuda);
        cpu.advance(contacts ? control : Control{});
        cuda.advance(contacts ? control : Control{});
        EXPECT_LT((cpu.state().positions - cuda.state().positions).rowwise().norm().maxCoeff(),
                  1e-8)
            << membrane << way << contacts;
      }
    }
  }
  const Cloth plain = make_cloth(garment, {0, 6});
  for (const std::string& way : barriers()) {
    XpbdOptions options;
    options.cuda_barrier = way;
    ClothSolver cpu(plain, {}, options);
    ClothSolver cuda(plain, {}, options, Device::Cuda);
    cpu.advance({});
    cuda.advance({});
    EXPECT_LT((cpu.state().positions - cuda.state().positions).rowwise().norm().maxCoeff(), 1e-5);
  }
}

/// The same for what a sanitizer has no patience for in longer tests: the body's edges.
class BodyEdgesTwins : public ::testing::TestWithParam<std::tuple<const char*, bool>> {};

TEST_P(BodyEdgesTwins, ShortFrames_Agree) {
  SKIP_WITHOUT_CUDA();
  const std::string way = std::get<0>(GetParam());
  const std::vector<std::string> ways = barriers();
  if (std::find(ways.begin(), ways.end(), way) == ways.end()) {
    GTEST_SKIP() << "no " << way << " on this device";
  }
  const Garment garment = fixtures::garment_of(fixtures::sheet(3, 3, 0.1, 'a'), 0.2, 300, 1e-5);
  const Mesh cube = fixtures::cube(0.0);
  Control control;
  control.body_start = 0.1 * cube.vertices;
  control.body_start.rowwise() += Eigen::RowVector3d(0.13, -0.002, 0.13);
  control.body_end = control.body_start.rowwise() + Eigen::RowVector3d(0, 0.004, 0);
  const Cloth cloth = make_cloth(garment, {0, 3});
  XpbdOptions options;
  options.precision = "double";
  options.substeps = 1;
  options.body_edges = true;
  options.self_contact = std::get<1>(GetParam());
  options.cuda_barrier = way;
  ClothSolver cpu(cloth, cube.faces, options);
  ClothSolver cuda(cloth, cube.faces, options, Device::Cuda);
  cpu.advance(control);
  cuda.advance(control);
  EXPECT_LT((cpu.state().positions - cuda.state().positions).rowwise().norm().maxCoeff(), 1e-8);
}

INSTANTIATE_TEST_SUITE_P(Barriers, BodyEdgesTwins,
                         ::testing::Combine(::testing::Values("block", "grid", "graph", "cluster"),
                                            ::testing::Bool()),
                         [](const auto& way) {
                           return std::string(std::get<0>(way.param)) +
                                  (std::get<1>(way.param) ? "_self" : "");
                         });

/// Limbs that close on a sheet push it out of the one and into the other, whence the frame's last
/// word takes it: who it sets on the surface is a hundredth of a millimetre off.
TEST(Twins, ShortFramesBetweenClosingLimbs_Agree) {
  const Garment garment = fixtures::garment_of(fixtures::sheet(12, 12, 0.012, 'a'), 0.2, 300, 1e-5);
  const Cloth cloth = make_cloth(garment, {});
  const Mesh limb = fixtures::sphere(0.1, 12, 24);
  const Index n = limb.vertices.rows();
  Triangles faces(2 * limb.faces.rows(), 3);
  faces << limb.faces, limb.faces.array() + static_cast<int>(n);
  const auto apart = [&](double gap) {
    Points out(2 * n, 3);
    for (int side = 0; side < 2; ++side) {
      out.middleRows(side * n, n) =
          limb.vertices.rowwise() +
          Eigen::RowVector3d(0.071, side == 0 ? -0.1 - gap / 2 : 0.1 + gap / 2, 0.073);
    }
    return out;
  };
  XpbdOptions options;
  options.precision = "double";
  options.substeps = 2;
  ClothSolver cpu(cloth, faces, options);
  std::unique_ptr<ClothSolver> cuda;
  if (cuda_available()) {
    cuda = std::make_unique<ClothSolver>(cloth, faces, options, Device::Cuda);
  }
  int set = 0;
  double gap = 0.02;
  for (const double next : {0.01, 0.0, -0.01, -0.004}) {
    Control control;
    control.body_start = apart(gap);
    control.body_end = apart(next);
    gap = next;
    cpu.advance(control);
    const TriangleTree tree = build_tree(control.body_end, faces);
    const Points x = cpu.state().positions;
    for (Index v = 0; v < x.rows(); ++v) {
      const double off = std::sqrt(closest_point(tree, x.row(v)).squared_distance);
      set += std::abs(off - 1e-5) < 1e-7 ? 1 : 0;
    }
    if (cuda != nullptr) {
      cuda->advance(control);
      EXPECT_LT((cpu.state().positions - cuda->state().positions).rowwise().norm().maxCoeff(), 1e-8)
          << gap;
    }
  }
  EXPECT_GT(set, 3) << "the scene does not show what it is for";
}

TEST(Twins, EveryBarrier_GivesTheSameBits) {
  SKIP_WITHOUT_CUDA();
  const Scene s = scene("springs", 0.001);
  for (int iterations : {1, 2}) {
    Points reference;
    for (const std::string& barrier : barriers()) {
      XpbdOptions options;
      options.cuda_barrier = barrier;
      options.iterations = iterations;
      ClothSolver solver(s.cloth, s.ball.faces, options, Device::Cuda);
      for (int i = 0; i < 20; ++i) {
        solver.advance(s.control(i));
      }
      const Points x = solver.state().positions;
      if (reference.rows() == 0) {
        reference = x;
      }
      EXPECT_EQ(x, reference) << barrier;
    }
  }
}

TEST(Repeat, AnyDeviceAndThreadCount_RepeatsBitIdentical) {
  const Scene s = scene("springs", 0);
  for (Device device : fixtures::devices()) {
    Points reference;
    for (int run = 0; run < 3; ++run) {
      set_thread_count(run == 1 ? 1 : 0);
      ClothSolver solver(s.cloth, s.ball.faces, {}, device);
      for (int i = 0; i < 30; ++i) {
        solver.advance(s.control(i));
      }
      if (run == 0) {
        reference = solver.state().positions;
      }
      EXPECT_EQ(solver.state().positions, reference) << device_name(device);
    }
    set_thread_count(0);
  }
}

/// Also where the body has turned meanwhile: the tree of the one who continues is built in another
/// pose.
TEST(Repeat, Checkpoint_ContinuesBitIdentical) {
  const Scene s = scene("springs", 0.001);
  const auto turning = [&](int frame) {
    Control control = s.control(frame);
    const auto turned = [&](const Points& from, int f) -> Points {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(0.07 * f, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
      const Eigen::RowVector3d centre = from.colwise().mean();
      return ((from.rowwise() - centre) * turn.transpose()).rowwise() + centre;
    };
    control.body_start = turned(control.body_start, frame);
    control.body_end = turned(control.body_end, frame + 1);
    return control;
  };
  for (Device device : fixtures::devices()) {
    for (bool turns : {false, true}) {
      const auto control = [&](int f) { return turns ? turning(f) : s.control(f); };
      ClothSolver whole(s.cloth, s.ball.faces, {}, device);
      ClothState middle;
      for (int i = 0; i < 30; ++i) {
        if (i == 13) {
          middle = whole.state();
        }
        whole.advance(control(i));
      }
      ClothSolver again(s.cloth, s.ball.faces, {}, device);
      again.set_state(middle);
      for (int i = 13; i < 30; ++i) {
        again.advance(control(i));
      }
      EXPECT_EQ(again.state().positions, whole.state().positions) << device_name(device) << turns;
      EXPECT_EQ(again.state().velocities, whole.state().velocities);
      EXPECT_EQ(again.state().frame, 30);
    }
  }
}

TEST(Sweep, EveryScene_MatchesItsSingleRun) {
  const Scene s = scene("springs", 0);
  const std::vector<ClothVariation> variations{{1, 1, -1}, {4, 0.1, 0.1}, {0.3, 10, 0.9}};
  for (Device device : fixtures::devices()) {
    for (const bool self_contact : {false, true}) {
      XpbdOptions options;
      options.self_contact = self_contact;
      ClothSweep sweep(s.cloth, variations, s.ball.faces, options, device);
      ASSERT_EQ(sweep.scene_count(), 3);
      std::vector<FrameReport> reports;
      for (int i = 0; i < 15; ++i) {
        reports = sweep.advance(s.control(i));
      }
      ASSERT_EQ(reports.size(), 3u);
      for (int scene_idx = 0; scene_idx < 3; ++scene_idx) {
        ClothSweep alone(s.cloth, {variations[scene_idx]}, s.ball.faces, options, device);
        for (int i = 0; i < 15; ++i) {
          alone.advance(s.control(i));
        }
        EXPECT_EQ(alone.state(0).positions, sweep.state(scene_idx).positions)
            << device_name(device);
      }
    }
  }
}

/// The same for as long as a sanitizer has patience.
TEST(Sweep, ShortScenes_MatchTheirSingleRuns) {
  const Cloth cloth =
      make_cloth(fixtures::garment_of(fixtures::sheet(6, 6, 0.05, 'a'), 0.2, 300, 1e-5), {0, 6});
  const Mesh ball = fixtures::sphere(0.15, 8, 12);
  Control control;
  control.body_start = ball.vertices.rowwise() + Eigen::RowVector3d(0.15, -0.152, 0.15);
  control.body_end = control.body_start;
  const std::vector<ClothVariation> variations{{1, 1, -1}, {4, 0.1, 0.1}};
  for (Device device : fixtures::devices()) {
    for (const bool self_contact : {false, true}) {
      XpbdOptions options;
      options.substeps = 2;
      options.self_contact = self_contact;
      ClothSweep sweep(cloth, variations, ball.faces, options, device);
      ClothSweep alone(cloth, {variations[1]}, ball.faces, options, device);
      for (int i = 0; i < 2; ++i) {
        sweep.advance(control);
        alone.advance(control);
      }
      EXPECT_EQ(alone.state(0).positions, sweep.state(1).positions) << device_name(device);
    }
  }
}

/// On a GPU so many particles that one thread each looks for what they may meet of the body.
TEST(Sweep, ManyScenes_MatchTheirSingleRuns) {
  const Cloth cloth = make_cloth(
      fixtures::garment_of(fixtures::sheet(45, 45, 0.012, 'a'), 0.2, 300, 1e-5), {0, 45});
  const Mesh ball = fixtures::sphere(0.15, 16, 24);
  for (Device device : fixtures::devices()) {
    std::vector<ClothVariation> variations(device == Device::Cpu ? 2 : 100);
    variations.back() = {1, 1, 0.9};
    const int last = static_cast<int>(variations.size()) - 1;
    ClothSweep sweep(cloth, variations, ball.faces, {}, device);
    ClothSweep alone(cloth, {variations.back()}, ball.faces, {}, device);
    int touching = 0;
    for (int i = 0; i < 12; ++i) {
      Control control;
      const auto at = [&](int frame) -> Points {
        return ball.vertices.rowwise() + Eigen::RowVector3d(0.27, -0.152, 0.27 + 0.002 * frame);
      };
      control.body_start = at(i);
      control.body_end = at(i + 1);
      sweep.advance(control);
      touching = alone.advance(control)[0].body_contacts;
    }
    EXPECT_GT(touching, 0);
    const Points expected = alone.state(0).positions;
    const auto most = [&](int scene) {
      return (sweep.state(scene).positions - expected).rowwise().norm().maxCoeff();
    };
    EXPECT_LT(most(last), 1e-6) << device_name(device);
    EXPECT_GT(most(0), 1e-5) << device_name(device);
  }
}

TEST(Sweep, Factors_ScaleTheStiffness) {
  const Scene s = scene("springs", 0.001);
  Cloth stiffer = s.cloth;
  for (ClothSpring& spring : stiffer.springs) {
    spring.stiffness *= 4;
  }
  for (ClothHinge& hinge : stiffer.hinges) {
    hinge.stiffness *= 0.25;
  }
  XpbdOptions options;
  options.precision = "double";
  for (Device device : fixtures::devices()) {
    ClothSweep sweep(s.cloth, {{1, 1, -1}, {4, 0.25, -1}}, s.ball.faces, options, device);
    ClothSolver alone(stiffer, s.ball.faces, options, device);
    for (int i = 0; i < 3; ++i) {
      sweep.advance(s.control(i));
      alone.advance(s.control(i));
    }
    const Points expected = alone.state().positions;
    EXPECT_LT((sweep.state(1).positions - expected).rowwise().norm().maxCoeff(), 1e-10);
    EXPECT_GT((sweep.state(0).positions - expected).rowwise().norm().maxCoeff(), 1e-6);
  }
}

TEST(Sweep, NoScenesOrNonPositiveFactors_AreRefused) {
  const Scene s = scene("springs", 0);
  EXPECT_THROW(ClothSweep(s.cloth, {}, s.ball.faces, {}), LogicError);
  EXPECT_THROW(ClothSweep(s.cloth, {{0, 1, -1}}, s.ball.faces, {}), LogicError);
  EXPECT_THROW(ClothSweep(s.cloth, {{1, -1, -1}}, s.ball.faces, {}), LogicError);
  EXPECT_THROW(ClothSweep(s.cloth, {{1, NAN, -1}}, s.ball.faces, {}), LogicError);
  ClothSweep sweep(s.cloth, {{1, 1, -1}}, s.ball.faces, {});
  EXPECT_THROW(sweep.state(1), LogicError);
  EXPECT_THROW(sweep.set_state(-1, rest_state(s.cloth)), LogicError);
}

TEST(Solver, OptionsOutOfRangeOrMissingCuda_AreRefused) {
  const Scene s = scene("springs", 0);
  XpbdOptions options;
  options.substeps = 0;
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  options = {};
  options.time_step = NAN;
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  options = {};
  options.vectors = "avx2";
  options.precision = "double";
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  options = {};
  options.sweep = "jacobian";
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  options = {};
  options.jacobi_radius = 1;
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  options = {};
  options.vectors = "sse";
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  options = {};
  options.precision = "half";
  EXPECT_THROW(ClothSolver(s.cloth, s.ball.faces, options), LogicError);
  if (!cuda_available()) {
    try {
      const ClothSolver solver(s.cloth, s.ball.faces, {}, Device::Cuda);
      FAIL();
    } catch (const EnvironmentError& e) {
      EXPECT_NE(std::string(e.what()).find("CUDA"), std::string::npos) << e.what();
    }
  }
}

/// A sweep that needs terabytes is refused in words, and what ran before still runs.
TEST(Solver, TooManyScenesForDeviceMemory_AreRefusedHarmlessly) {
  SKIP_WITHOUT_CUDA();
  const Scene s = scene("springs", 0);
  ClothSolver before(s.cloth, s.ball.faces, {}, Device::Cuda);
  before.advance(s.control(0));
  const Points good = before.state().positions;
  XpbdOptions options;
  options.report = false;
  try {
    const ClothSweep sweep(s.cloth, std::vector<ClothVariation>(2000000), s.ball.faces, options,
                           Device::Cuda);
    FAIL() << "two million scenes fit";
  } catch (const EnvironmentError& e) {
    EXPECT_NE(std::string(e.what()).find("memory"), std::string::npos) << e.what();
  }
  EXPECT_EQ(before.state().positions, good);
  before.advance(s.control(1));
  EXPECT_TRUE(before.state().positions.allFinite());
  EXPECT_EQ(before.state().frame, 2);
}

TEST(Solver, NonFinitePosition_StopsTheSolverAtTheLastFrame) {
  const Cloth cloth = make_cloth(fixtures::garment_of(fixtures::sheet(4, 4, 0.05), 0.2, 100, 1e-5));
  for (Device device : fixtures::devices()) {
    ClothSolver solver(cloth, {}, {}, device);
    solver.advance({});
    const Points good = solver.state().positions;
    Control control;
    control.gravity.y() = -1e300;  // beyond float
    try {
      solver.advance(control);
      FAIL();
    } catch (const DataError& e) {
      EXPECT_NE(std::string(e.what()).find("frame 2, vertex 0"), std::string::npos) << e.what();
    }
    EXPECT_EQ(solver.state().positions, good);
  }
}

}  // namespace
}  // namespace atelier
