#include "appearance/network/launch.h"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <mutex>
#include <sstream>
#include <thread>

#include <unistd.h>

#include "core/error.h"
#include "core/io/child_program.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

std::string lost_text(int rank, int processes) {
  return "process " + std::to_string(rank) + " of " + std::to_string(processes) +
         " is lost, and a checkpoint goes on with any number of them";
}

/// An empty file for processes to find each other, gone in the end.
struct Rendezvous {
  std::string path = (fs::temp_directory_path() / "atelier-XXXXXX").string();

  Rendezvous() {
    const int file = mkstemp(path.data());
    if (file < 0) {
      throw EnvironmentError(path, "cannot be made");
    }
    close(file);
  }
  ~Rendezvous() { unlink(path.c_str()); }
  Rendezvous(const Rendezvous&) = delete;
  Rendezvous& operator=(const Rendezvous&) = delete;
};

}  // namespace

std::optional<PeerPlace> launched_place(const LaunchOptions& options) {
  const EnvironmentVariables environment = [](const std::string& name) {
    const char* value = std::getenv(name.c_str());
    return std::string(value == nullptr ? "" : value);
  };
  if (options.launcher != Launcher::Self) {
    if (options.processes > 1 || options.rank >= 0) {
      throw UsageError("--processes and --rank are said by the launcher; leave them out");
    }
    return options.launcher == Launcher::Slurm ? slurm_place(environment)
                                               : torchrun_place(environment);
  }
  if (options.rank < 0) {
    return std::nullopt;
  }
  if (options.rank >= options.processes || options.rendezvous.empty()) {
    throw UsageError("--rank is below --processes, and has a --rendezvous");
  }
  return PeerPlace{options.rank, options.processes, options.rank, options.rendezvous};
}

void take_place(const PeerPlace& place, const LaunchOptions& options) {
  if (options.device == Device::Cuda) {
    const char* all = std::getenv("CUDA_VISIBLE_DEVICES");
    std::istringstream listed(all == nullptr ? "" : all);
    std::string own = std::to_string(place.local_rank);
    for (int k = 0; all != nullptr && k <= place.local_rank; ++k) {
      own.clear();
      std::getline(listed, own, ',');
    }
    if (own.empty()) {
      throw EnvironmentError("CUDA_VISIBLE_DEVICES", std::string(all) + " has no GPU for process " +
                                                         std::to_string(place.local_rank) +
                                                         "; start fewer");
    }
    setenv("CUDA_VISIBLE_DEVICES", own.c_str(), 1);
  }
  if (options.launcher == Launcher::Self && std::getenv("OMP_NUM_THREADS") == nullptr) {
    const unsigned threads =
        std::thread::hardware_concurrency() / static_cast<unsigned>(options.processes);
    setenv("OMP_NUM_THREADS", std::to_string(std::max(1U, threads)).c_str(), 1);
  }
}

bool run_together(const std::vector<std::string>& words, int processes,
                  const std::function<void(const std::string& line)>& say,
                  const std::function<bool()>& stop) {
  const Rendezvous rendezvous;
  std::mutex mutex;
  std::exception_ptr error;  // of the process that ended first
  bool whole = true;
  std::vector<std::thread> threads;
  for (int rank = 0; rank < processes; ++rank) {
    std::vector<std::string> own = words;
    own.insert(own.end(), {"--rank", std::to_string(rank), "--rendezvous", rendezvous.path});
    threads.emplace_back([&, own, rank] {
      try {
        const bool done = run_child_program(
            "atelier-appearance", own, "",
            [&](const std::string& line) {
              if (rank == 0) {
                say(line);
              }
            },
            [&] {
              const std::lock_guard lock(mutex);
              return stop() || error != nullptr;
            });
        const std::lock_guard lock(mutex);
        whole = whole && done;
      } catch (const EnvironmentError& lost) {
        const bool killed = lost.reason.starts_with("ended by signal");
        const std::lock_guard lock(mutex);
        error =
            error != nullptr ? error
            : killed
                ? std::make_exception_ptr(EnvironmentError(lost_text(rank, processes), lost.reason))
                : std::current_exception();
      } catch (...) {
        const std::lock_guard lock(mutex);
        error = error == nullptr ? std::current_exception() : error;
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  if (error != nullptr) {
    std::rethrow_exception(error);
  }
  return whole;
}

}  // namespace atelier
