// falling_sheet STATE DIES DEVICE: what KilledRun.KilledProcess_ResumesBitIdentical starts. Goes on
// from the state in the file STATE, if it is there, to the last frame, writes it after each, and is
// killed within frame DIES; below 0: never.
#include "tests/simulation/falling_sheet.h"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>

#include "simulation/cloth_state_archive.h"

namespace {

void go_on(const std::filesystem::path& path, int dies, atelier::Device device) {
  atelier::fixtures::FallingSheet run(device);
  if (std::filesystem::exists(path)) {
    run.set_state(atelier::cloth_state_of(atelier::read_archive(path, "atelier.cloth_state", 1),
                                          run.state().positions.rows(), path.string()));
  }
  while (run.state().frame < atelier::fixtures::FallingSheet::kFrames) {
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
    atelier::write_archive(path, atelier::archive_of(run.state()));
    if (killer.joinable()) {
      killer.join();
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: falling_sheet STATE DIES cpu|cuda\n");
    return 2;
  }
  try {
    const bool cuda = std::string(argv[3]) == atelier::device_name(atelier::Device::Cuda);
    go_on(argv[1], std::atoi(argv[2]), cuda ? atelier::Device::Cuda : atelier::Device::Cpu);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "falling_sheet: %s\n", error.what());
    return 1;
  }
  return 0;
}
