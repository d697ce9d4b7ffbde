#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "appearance/network/peer_place.h"
#include "core/device.h"

namespace atelier {

/// Who starts the processes that train together.
enum class Launcher { Self, Torchrun, Slurm };

/// How this process came to be.
struct LaunchOptions {
  Launcher launcher = Launcher::Self;
  int rank = -1;           ///< among those that train together; below 0: it starts them
  int processes = 1;       ///< that train together, on this machine
  std::string rendezvous;  ///< file through which processes with a rank find each other
  Device device = Device::Cpu;
};

/// Where this process stands among those that train together; nothing where it trains alone. Throws
/// UsageError, EnvironmentError.
std::optional<PeerPlace> launched_place(const LaunchOptions& options);

/// Chooses this process's GPU before CUDA begins, and its share of the processor.
void take_place(const PeerPlace& place, const LaunchOptions& options);

/// Starts the processes that train together and waits for them: of errors the first is thrown.
/// Returns whether all came to their end.
/// @param words  of the program, behind its name
/// @param say    told the lines of the first one
/// @param stop   asked now and then
bool run_together(const std::vector<std::string>& words, int processes,
                  const std::function<void(const std::string& line)>& say,
                  const std::function<bool()>& stop);

}  // namespace atelier
