#ifdef ATELIER_HAS_CUDA

#include "tests/support/device_memory.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cuda_check.h"
#include "core/device.h"
#include "core/error.h"
#include "simulation/solver.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

using fixtures::EndOfDeviceMemory;
using ::testing::HasSubstr;

class DeviceMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!cuda_available()) {
      GTEST_SKIP() << "no CUDA device";
    }
  }
};

/// The text of the error that `call` ends with for want of device memory, or "".
std::string want_of_memory(const std::function<void()>& call) {
  try {
    call();
  } catch (const EnvironmentError& error) {
    EXPECT_EQ(error.place, kDeviceMemory) << error.what();
    return error.what();
  }
  return "";
}

/// A pile of sheets that falls on a floor, 0.1 m below: its lists of pairs are short at first.
struct FallingPile {
  Mesh floor = fixtures::incline(0, 2);
  Cloth cloth;
  Control control = fixtures::still(floor.vertices);

  explicit FallingPile(int sheets, int cells) {
    std::vector<Cloth> layers;
    for (int k = 0; k < sheets; ++k) {
      Garment garment =
          fixtures::garment_of(fixtures::sheet(cells, cells, 0.01, 'a'), 0.2, 400, 2e-6);
      garment.mesh.vertices.col(1).array() += 0.1 + 0.02 * k;
      garment.material.thickness = 2e-3;
      garment.material.damping = 1e-4;
      layers.push_back(make_cloth(garment));
    }
    cloth = join_cloths(layers);
  }
};

struct Way {
  const char* name;
  XpbdOptions options;
};

std::vector<Way> ways() {
  XpbdOptions usual;
  usual.substeps = 5;
  usual.self_contact = true;
  usual.report = true;
  usual.drag = 1;
  usual.air_density = 1.2;
  Way plain{"with contact", usual};
  Way exact{"in double", usual};
  exact.options.precision = "double";
  Way graph{"as a graph", usual};
  graph.options.self_contact = false;
  graph.options.cuda_barrier = "graph";
  Way jacobi{"by Jacobi", usual};
  jacobi.options.self_contact = false;
  jacobi.options.sweep = "jacobi";
  return {plain, exact, graph, jacobi};
}

// Whichever allocation of a solver fails, from the first of its setup to the last of its first
// frames (a sample of them; all with ATELIER_SOAK=1): the error says so, what was taken is given
// back, and a frame that was lost can be done again with the same bits.
TEST_F(DeviceMemory, AnyFailedAllocationOfASolver_IsReportedAndUndone) {
  const FallingPile pile(3, 6);
  for (const Way& way : ways()) {
    SCOPED_TRACE(way.name);
    const auto make = [&] {
      return std::make_unique<ClothSolver>(pile.cloth, pile.floor.faces, way.options, Device::Cuda);
    };
    std::vector<Points> expected;
    int allocations = fixtures::device_allocations();
    {
      const auto solver = make();
      for (int frame = 0; frame < 2; ++frame) {
        solver->advance(pile.control);
        expected.push_back(solver->state().positions);
      }
    }
    allocations = fixtures::device_allocations() - allocations;
    ASSERT_GT(allocations, 20);
    const int alive = fixtures::device_allocations_alive();
    int in_setup = 0;
    int in_frames = 0;
    const int stride = fixtures::soaking() ? 1 : std::max(1, allocations / 20);
    for (int good = 0; good < allocations; good += stride) {
      SCOPED_TRACE(good);
      std::unique_ptr<ClothSolver> solver;
      std::vector<Points> found;
      std::string text;
      {
        const EndOfDeviceMemory end(good);
        text = want_of_memory([&] {
          solver = make();
          while (found.size() < expected.size()) {
            solver->advance(pile.control);
            found.push_back(solver->state().positions);
          }
        });
        EXPECT_GT(EndOfDeviceMemory::failed(), 0);
      }
      EXPECT_THAT(text, HasSubstr("out of memory"));
      EXPECT_THAT(text, HasSubstr(" free of "));
      EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "left behind";
      ++(solver == nullptr ? in_setup : in_frames);
      if (solver != nullptr) {
        EXPECT_EQ(solver->state().frame, static_cast<std::int64_t>(found.size()));
        while (found.size() < expected.size()) {
          ASSERT_NO_THROW(solver->advance(pile.control));
          found.push_back(solver->state().positions);
        }
        EXPECT_EQ(found, expected);
      }
      solver.reset();
      ASSERT_EQ(fixtures::device_allocations_alive(), alive);
    }
    EXPECT_GT(in_setup, 0);
    EXPECT_GT(in_frames, 0);
  }
}

TEST_F(DeviceMemory, AnyFailedAllocationOfProjectiveDynamics_IsReportedAndUndone) {
  const FallingPile pile(3, 6);
  SolverOptions options;
  options.name = "projective-friction";
  options.projective.substeps = 2;
  options.self_contact = true;
  options.drag = 1;
  const SimulationModel model{pile.cloth, pile.floor.faces};
  std::vector<Points> expected;
  int allocations = fixtures::device_allocations();
  {
    const auto solver = create_solver(model, options, Device::Cuda);
    for (int frame = 0; frame < 3; ++frame) {
      solver->step(pile.control);
      expected.push_back(solver->state().positions);
    }
  }
  allocations = fixtures::device_allocations() - allocations;
  ASSERT_GT(allocations, 20);
  const int alive = fixtures::device_allocations_alive();
  const int stride = fixtures::soaking() ? 1 : std::max(1, allocations / 20);
  for (int good = 0; good < allocations; good += stride) {
    SCOPED_TRACE(good);
    std::unique_ptr<Solver> solver;
    std::vector<Points> found;
    {
      const EndOfDeviceMemory end(good);
      const std::string text = want_of_memory([&] {
        solver = create_solver(model, options, Device::Cuda);
        while (found.size() < expected.size()) {
          solver->step(pile.control);
          found.push_back(solver->state().positions);
        }
      });
      EXPECT_THAT(text, HasSubstr("out of memory"));
    }
    EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "left behind";
    while (solver != nullptr && found.size() < expected.size()) {
      ASSERT_NO_THROW(solver->step(pile.control));
      found.push_back(solver->state().positions);
    }
    EXPECT_TRUE(solver == nullptr || found == expected);
    solver.reset();
    ASSERT_EQ(fixtures::device_allocations_alive(), alive);
  }
}

// Lists of pairs grow where cloth comes together, in the middle of a run.
TEST_F(DeviceMemory, FrameEndedByFullMemory_IsUndoneAndTheRunContinues) {
  const FallingPile pile(16, 16);
  XpbdOptions options;
  options.self_contact = true;
  constexpr int kFrames = 40;
  std::vector<ClothState> states;
  int grown = 0;  // the first frame that takes memory, after the first
  int allocations = 0;
  {
    ClothSolver solver(pile.cloth, pile.floor.faces, options, Device::Cuda);
    for (int frame = 1; frame <= kFrames; ++frame) {
      const int before = fixtures::device_allocations();
      solver.advance(pile.control);
      states.push_back(solver.state());
      if (frame > 1 && grown == 0 && fixtures::device_allocations() > before) {
        grown = frame;
        allocations = fixtures::device_allocations() - before;
      }
    }
  }
  ASSERT_GT(grown, 2) << "no list grows";
  RecordProperty("grown_in_frame", grown);
  for (int good = 0; good < allocations; ++good) {
    SCOPED_TRACE(good);
    ClothSolver solver(pile.cloth, pile.floor.faces, options, Device::Cuda);
    for (int frame = 1; frame < grown; ++frame) {
      solver.advance(pile.control);
    }
    for (const int now : {good, 0}) {  // it stays as it is, however often it is asked
      const EndOfDeviceMemory end(now);
      EXPECT_THAT(want_of_memory([&] { solver.advance(pile.control); }),
                  HasSubstr("out of memory"));
      EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "left behind";
      const ClothState& last = states[static_cast<std::size_t>(grown) - 2];
      EXPECT_EQ(solver.state().frame, grown - 1);
      EXPECT_EQ(solver.state().positions, last.positions);
      EXPECT_EQ(solver.state().velocities, last.velocities);
    }
    for (int frame = grown; frame <= kFrames; ++frame) {
      ASSERT_NO_THROW(solver.advance(pile.control));
      const ClothState& expected = states[static_cast<std::size_t>(frame) - 1];
      ASSERT_EQ(solver.state().positions, expected.positions) << frame;
      ASSERT_EQ(solver.state().velocities, expected.velocities) << frame;
    }
  }
}

// No double: a device that is full. Others on it fail meanwhile, so on request alone.
TEST_F(DeviceMemory, FullDevice_IsRefusedAndUsableAgain) {
  if (!fixtures::soaking()) {
    GTEST_SKIP() << "part of scripts/gpu and scripts/soak";
  }
  const FallingPile pile(4, 12);
  XpbdOptions options;
  options.substeps = 5;
  options.self_contact = true;
  const auto last_height = [&] {
    ClothSolver solver(pile.cloth, pile.floor.faces, options, Device::Cuda);
    for (int frame = 0; frame < 3; ++frame) {
      solver.advance(pile.control);
    }
    return solver.state().positions(0, 1);
  };
  const double expected = last_height();
  {
    const fixtures::FullDevice full;
    const std::string text = want_of_memory(last_height);
    EXPECT_THAT(text, HasSubstr("out of memory"));
    EXPECT_THAT(text, HasSubstr(" free of "));
  }
  EXPECT_EQ(last_height(), expected);
}

}  // namespace
}  // namespace atelier

#endif
