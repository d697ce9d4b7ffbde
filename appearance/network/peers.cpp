#include "appearance/network/peers.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <torch/csrc/distributed/c10d/FileStore.hpp>
#include <torch/csrc/distributed/c10d/TCPStore.hpp>
#include <utility>
#include <vector>

#include <torch/torch.h>
#include <torch/version.h>
#if ATELIER_GLOO
#include <torch/csrc/distributed/c10d/ProcessGroupGloo.hpp>
#endif
#if ATELIER_NCCL
#include <torch/csrc/distributed/c10d/ProcessGroupNCCL.hpp>
#endif
#if ATELIER_TORCH_CUDA
#include <ATen/cuda/CUDAEvent.h>
#endif

#include "appearance/network/peer_tensors.h"
#include "core/error.h"

namespace atelier {
namespace {

#if TORCH_VERSION_MAJOR >= 2
using Group = c10d::Backend;
#else
using Group = c10d::ProcessGroup;
#endif
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kBeat{1};            // from sign of life to sign of life
constexpr std::chrono::seconds kPatience{20};       // without one
constexpr std::chrono::seconds kBrokenPatience{4};  // once a sum has failed: somebody is lost
constexpr std::chrono::minutes kMeeting{2};
constexpr const char* kTogether = "processes that train together";

/// Where the processes find each other.
c10::intrusive_ptr<c10d::Store> store_at(const PeerPlace& place) {
  const std::string tcp = "tcp://";
  if (!place.rendezvous.starts_with(tcp)) {
    return c10::make_intrusive<c10d::FileStore>(place.rendezvous, place.size);
  }
  const std::size_t colon = place.rendezvous.rfind(':');
  c10d::TCPStoreOptions options;
  options.port = static_cast<std::uint16_t>(std::stoi(place.rendezvous.substr(colon + 1)));
  options.isServer = place.rank == 0;
  options.numWorkers = static_cast<std::size_t>(place.size);
  options.timeout = kMeeting;
  return c10::make_intrusive<c10d::TCPStore>(
      place.rendezvous.substr(tcp.size(), colon - tcp.size()), options);
}

c10::intrusive_ptr<Group> group_of(const c10::intrusive_ptr<c10d::Store>& store,
                                   const PeerPlace& place, Device device) {
  if (device == Device::Cuda) {
#if ATELIER_NCCL
    auto options = c10d::ProcessGroupNCCL::Options::create();
    return c10::make_intrusive<c10d::ProcessGroupNCCL>(store, place.rank, place.size, options);
#else
    throw EnvironmentError(kTogether, "this build has no NCCL; train with --processes 1");
#endif
  }
#if ATELIER_GLOO
  auto options = c10d::ProcessGroupGloo::Options::create();
  const bool one_machine = !place.rendezvous.starts_with("tcp://");
  options->devices.push_back(one_machine
                                 ? c10d::ProcessGroupGloo::createDeviceForHostname("127.0.0.1")
                                 : c10d::ProcessGroupGloo::createDefaultDevice());
  options->timeout = kMeeting;
  return c10::make_intrusive<c10d::ProcessGroupGloo>(store, place.rank, place.size, options);
#else
  throw EnvironmentError(kTogether, "this build has no Gloo; train with --processes 1");
#endif
}

/// The first line of what libtorch says, without the place in its source.
std::string reason_of(const std::exception& error) {
  const std::string text = error.what();
  return text.substr(0, std::min<std::size_t>(text.find('\n'), 200));
}

}  // namespace

struct Peers::State {
  PeerPlace place;
  Device device = Device::Cpu;
  c10::intrusive_ptr<c10d::Store> store;
  c10::intrusive_ptr<Group> group;
  std::function<void(const std::string&)> lost;
  double seconds = 0;
#if ATELIER_TORCH_CUDA
  std::deque<std::pair<at::cuda::CUDAEvent, at::cuda::CUDAEvent>> timed;  // sums on their way
#endif
  std::thread watch;
  std::mutex mutex;
  std::condition_variable ending;
  bool finished = false;  // guarded by mutex
  std::atomic<bool> broken{false};

  double sum_of(double mine) {
    std::vector<torch::Tensor> all = {torch::full(
        {1}, mine,
        torch::device(device == Device::Cuda ? torch::kCUDA : torch::kCPU).dtype(torch::kFloat64))};
    together([&] { group->allreduce(all)->wait(); });
    return all[0].item<double>();
  }

  /// Waits so long; true at the end of all work.
  bool finished_within(Clock::duration time) {
    std::unique_lock lock(mutex);
    return ending.wait_for(lock, time, [&] { return finished; });
  }

  void say_lost(int rank, bool mine_to_say) {
    lost(mine_to_say ? "process " + std::to_string(rank) + " of " + std::to_string(place.size) +
                           " is lost, and a checkpoint goes on with any number of them"
                     : "");
  }

  /// Gives signs of life, and looks for those of the others.
  void keep_watch() {
    const auto count = static_cast<std::size_t>(place.size);
    std::vector<std::int64_t> beats(count, -1);
    std::vector<Clock::time_point> heard(count, Clock::now());
    while (!finished_within(kBeat)) {
      try {
        store->add("alive" + std::to_string(place.rank), 1);
        std::vector<int> silent;
        for (std::size_t p = 0; p < count; ++p) {
          const std::int64_t now = store->add("alive" + std::to_string(p), 0);
          if (std::exchange(beats[p], now) != now) {
            heard[p] = Clock::now();
          } else if (Clock::now() - heard[p] > (broken ? kBrokenPatience : kPatience)) {
            silent.push_back(static_cast<int>(p));
          }
        }
        if (store->add("ended", 0) > 0 && !finished_within(kBeat)) {
          say_lost(-1, false);  // it has said why itself
        }
        if (!silent.empty() && !finished_within(kBeat)) {
          const bool lowest = std::count_if(silent.begin(), silent.end(),
                                            [&](int p) { return p < place.rank; }) == place.rank;
          say_lost(silent.front(), lowest);
        }
      } catch (const std::exception&) {  // the store is gone, and with it rank 0
        if (!finished_within(2 * kBeat)) {
          say_lost(0, place.rank == 1);
        }
      }
    }
  }

  /// Runs work of all. One that fails lacks a process: the watch will say which.
  template <class Work>
  void together(const Work& work) {
    try {
      work();
    } catch (const std::exception& error) {
      broken = true;
      finished_within(kPatience);
      throw EnvironmentError(kTogether, reason_of(error));
    }
  }
};

Peers::Peers(const PeerPlace& place, Device device,
             std::function<void(const std::string& message)> lost)
    : state_(std::make_unique<State>()) {
  state_->place = place;
  state_->device = device;
  state_->lost = std::move(lost);
  try {
    state_->store = store_at(place);
    state_->group = group_of(state_->store, place, device);
    any(false);  // all are there
  } catch (const EnvironmentError&) {
    throw;
  } catch (const std::exception& error) {
    throw EnvironmentError(kTogether, std::to_string(place.size) + " did not come together at " +
                                          place.rendezvous + ": " + reason_of(error));
  }
  state_->watch = std::thread([this] { state_->keep_watch(); });
}

Peers::~Peers() {
  State& state = *state_;
  const bool ended = !state.finished_within({});
  {
    const std::lock_guard lock(state.mutex);
    state.finished = true;
  }
  state.ending.notify_all();
  if (state.watch.joinable()) {
    state.watch.join();
  }
  if (ended && state.store) {
    try {
      state.store->add("ended", 1);
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): nobody is left to tell
    }
  }
}

int Peers::rank() const {
  return state_->place.rank;
}

int Peers::size() const {
  return state_->place.size;
}

bool Peers::any(bool mine) {
  return state_->sum_of(mine ? 1 : 0) > 0;
}

std::int64_t Peers::of_first(std::int64_t mine) {
  return static_cast<std::int64_t>(state_->sum_of(rank() == 0 ? static_cast<double>(mine) : 0));
}

void Peers::finish() {
  any(false);
  {
    const std::lock_guard lock(state_->mutex);
    state_->finished = true;
  }
  state_->ending.notify_all();
#if ATELIER_NCCL && TORCH_VERSION_MAJOR >= 2
  if (state_->device == Device::Cuda) {
    static_cast<c10d::ProcessGroupNCCL&>(*state_->group).shutdown();
  }
#endif
}

double Peers::seconds() const {
#if ATELIER_TORCH_CUDA
  for (; !state_->timed.empty(); state_->timed.pop_front()) {
    auto& [begin, end] = state_->timed.front();
    end.synchronize();
    state_->seconds += begin.elapsed_time(end) / 1000.0;
  }
#endif
  return state_->seconds;
}

void sum_over(Peers& peers, torch::Tensor& numbers) {
  Peers::State& state = peers.state();
  state.together([&] {
    std::vector<torch::Tensor> all = {numbers};
#if ATELIER_TORCH_CUDA
    if (state.device == Device::Cuda) {
      constexpr std::size_t kMostTimed = 1000;
      if (state.timed.size() > kMostTimed) {
        peers.seconds();
      }
      auto& [begin, end] = state.timed.emplace_back(at::cuda::CUDAEvent(cudaEventDefault),
                                                    at::cuda::CUDAEvent(cudaEventDefault));
      begin.record();
      state.group->allreduce(all)->wait();
      end.record();
      return;
    }
#endif
    const auto begin = Clock::now();
    state.group->allreduce(all)->wait();
    state.seconds += std::chrono::duration<double>(Clock::now() - begin).count();
  });
}

torch::Tensor gathered(Peers& peers, const torch::Tensor& numbers) {
  std::vector<std::int64_t> shape = numbers.sizes().vec();
  shape.insert(shape.begin(), peers.size());
  torch::Tensor all = torch::zeros(shape, numbers.options());
  all.select(0, peers.rank()).copy_(numbers);
  sum_over(peers, all);
  return all;
}

}  // namespace atelier
