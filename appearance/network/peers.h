#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "appearance/network/peer_place.h"
#include "core/device.h"

namespace atelier {

/// Processes that train one network together, each on its own part of every batch (implemented with
/// libtorch's c10d: Gloo on CPUs, NCCL on GPUs). What is said to be of all is called by all, in the
/// same order.
class Peers {
 public:
  /// Waits for all. Throws EnvironmentError if they do not come together within two minutes, or
  /// this build lacks what the device takes.
  /// @param lost  called by another thread, within half a minute, where a process is lost: it ends
  ///              this one, which may wait for ever. The message is empty in all but one of them.
  Peers(const PeerPlace& place, Device device,
        std::function<void(const std::string& message)> lost);
  /// The others take this process for one that has ended by itself, and said why.
  ~Peers();
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;

  int rank() const;
  int size() const;
  /// Of all: whether it is true for any.
  bool any(bool mine);
  /// Of all: the number that the first process gives, up to 2^53.
  std::int64_t of_first(std::int64_t mine);
  /// Of all: waits until the work of every process is done; none is missed from then on.
  void finish();
  /// Seconds that sums have taken so far, waiting for the others included.
  double seconds() const;

  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

}  // namespace atelier
