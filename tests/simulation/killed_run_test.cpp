#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

constexpr int kFrames = 16;

/// A sheet that falls into folds over a moving ball, with every contact.
class FallingSheet {
 public:
  explicit FallingSheet(Device device)
      : ball_(fixtures::sphere(0.1, 16, 24)), cloth_(sheet()), solver_(solver(device)) {}

  void set_state(const ClothState& state) { solver_.set_state(state); }
  ClothState state() const { return solver_.state(); }
  void advance() {
    const auto at = [&](std::int64_t frame) -> Points {
      return ball_.vertices.rowwise() +
             Eigen::RowVector3d(0.03 * std::sin(0.3 * static_cast<double>(frame)), -0.103, 0);
    };
    const std::int64_t frame = solver_.state().frame;
    Control control;
    control.body_start = at(frame);
    control.body_end = at(frame + 1);
    solver_.advance(control);
  }

 private:
  static Cloth sheet() {
    Garment garment = fixtures::garment_of(fixtures::sheet(20, 20, 0.02, 'a'), 0.2, 300, 1e-6);
    garment.mesh.vertices.col(0).array() -= 0.2;
    garment.mesh.vertices.col(2).array() -= 0.2;
    return make_cloth(garment);
  }
  ClothSolver solver(Device device) const {
    XpbdOptions options;
    options.self_contact = true;
    return ClothSolver(cloth_, ball_.faces, options, device);
  }

  Mesh ball_;
  Cloth cloth_;
  ClothSolver solver_;
};

void save(const ClothState& state, const std::filesystem::path& path) {
  const std::filesystem::path fresh = path.string() + ".new";
  {
    std::ofstream file(fresh, std::ios::binary);
    const Index rows = state.positions.rows();
    file.write(reinterpret_cast<const char*>(&state.frame), sizeof(state.frame));
    file.write(reinterpret_cast<const char*>(&rows), sizeof(rows));
    for (const Points* points : {&state.positions, &state.velocities}) {
      file.write(reinterpret_cast<const char*>(points->data()),
                 static_cast<std::streamsize>(points->size() * sizeof(double)));
    }
  }
  std::filesystem::rename(fresh, path);
}

ClothState load(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  ClothState state;
  Index rows = 0;
  file.read(reinterpret_cast<char*>(&state.frame), sizeof(state.frame));
  file.read(reinterpret_cast<char*>(&rows), sizeof(rows));
  for (Points* points : {&state.positions, &state.velocities}) {
    points->resize(rows, 3);
    file.read(reinterpret_cast<char*>(points->data()),
              static_cast<std::streamsize>(points->size() * sizeof(double)));
  }
  EXPECT_TRUE(file.good());
  return state;
}

// What KilledRun.ContinuesWithTheSameBits starts: goes on from the last frame that it finds, and is
// killed within frame ATELIER_RUN_DIES.
TEST(KilledRun, DISABLED_Worker) {
  const std::filesystem::path path = std::getenv("ATELIER_RUN_STATE");
  const int dies = std::atoi(std::getenv("ATELIER_RUN_DIES"));
  const std::string device = std::getenv("ATELIER_RUN_DEVICE");
  FallingSheet run(device == device_name(Device::Cuda) ? Device::Cuda : Device::Cpu);
  if (std::filesystem::exists(path)) {
    run.set_state(load(path));
  }
  while (run.state().frame < kFrames) {
    std::atomic<bool> begun{false};
    std::thread killer;
    if (run.state().frame == dies) {
      killer = std::thread([&] {
        begun.wait(false);
        std::raise(SIGKILL);
      });
      begun = true;
      begun.notify_one();
    }
    run.advance();
    save(run.state(), path);
    if (killer.joinable()) {
      killer.join();
    }
  }
}

TEST(KilledRun, ContinuesWithTheSameBits) {
  for (Device device : fixtures::devices()) {
    FallingSheet whole(device);
    for (int i = 0; i < kFrames; ++i) {
      whole.advance();
    }
    const fixtures::TemporaryDirectory folder;
    const std::filesystem::path path = folder / "state";
    for (int dies : {2, 9, -1}) {
      const fixtures::ChildResult result = fixtures::run_child(
          {"env", "-u", "GTEST_TOTAL_SHARDS", "-u", "GTEST_SHARD_INDEX",
           "ATELIER_RUN_STATE=" + path.string(), "ATELIER_RUN_DIES=" + std::to_string(dies),
           std::string("ATELIER_RUN_DEVICE=") + device_name(device),
           std::filesystem::read_symlink("/proc/self/exe").string(),
           "--gtest_filter=KilledRun.DISABLED_Worker", "--gtest_also_run_disabled_tests"});
      if (dies >= 0) {
        ASSERT_EQ(result.signal, SIGKILL) << result.out << result.err;
      } else {
        ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
      }
    }
    const ClothState end = load(path);
    EXPECT_EQ(end.frame, kFrames);
    EXPECT_EQ(end.positions, whole.state().positions) << device_name(device);
    EXPECT_EQ(end.velocities, whole.state().velocities) << device_name(device);
  }
}

}  // namespace
}  // namespace atelier
