#include "appearance/network/peer_place.h"

#include <charconv>

#include "core/error.h"

namespace atelier {
namespace {

constexpr int kLargestWorld = 4096;
constexpr int kLargestPort = 65535;

/// The whole number of a variable within [from, to].
int number_of(const EnvironmentVariables& environment, const char* name, int from, int to) {
  const std::string text = environment(name);
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < from || number > to) {
    throw EnvironmentError(name, (text.empty() ? "not set" : "'" + text.substr(0, 40) + "'") +
                                     std::string("; expected a number from ") +
                                     std::to_string(from) + " to " + std::to_string(to));
  }
  return number;
}

std::string text_of(const EnvironmentVariables& environment, const char* name) {
  std::string text = environment(name);
  if (text.empty()) {
    throw EnvironmentError(name, "not set; expected the host of rank 0");
  }
  return text;
}

}  // namespace

PeerPlace torchrun_place(const EnvironmentVariables& environment) {
  PeerPlace place;
  place.size = number_of(environment, "WORLD_SIZE", 1, kLargestWorld);
  place.rank = number_of(environment, "RANK", 0, place.size - 1);
  place.local_rank = number_of(environment, "LOCAL_RANK", 0, place.rank);
  place.rendezvous = "tcp://" + text_of(environment, "MASTER_ADDR") + ":" +
                     std::to_string(number_of(environment, "MASTER_PORT", 1, kLargestPort));
  return place;
}

PeerPlace slurm_place(const EnvironmentVariables& environment) {
  PeerPlace place;
  place.size = number_of(environment, "SLURM_NTASKS", 1, kLargestWorld);
  place.rank = number_of(environment, "SLURM_PROCID", 0, place.size - 1);
  place.local_rank = number_of(environment, "SLURM_LOCALID", 0, place.rank);
  std::string host = environment("MASTER_ADDR");
  if (host.empty()) {
    host = first_host(text_of(environment, "SLURM_STEP_NODELIST"));
  }
  constexpr int kFirstPort = 20'000;  // two jobs of one node have different ones, most likely
  constexpr int kPorts = 12'000;      // below those that a system gives away by itself
  const int port =
      environment("MASTER_PORT").empty()
          ? kFirstPort + number_of(environment, "SLURM_JOB_ID", 0, 2'000'000'000) % kPorts
          : number_of(environment, "MASTER_PORT", 1, kLargestPort);
  place.rendezvous = "tcp://" + host + ":" + std::to_string(port);
  return place;
}

std::string first_host(const std::string& list) {
  const std::size_t comma = list.find(',');
  const std::size_t open = list.find('[');
  if (open == std::string::npos || comma < open) {
    return list.substr(0, comma);
  }
  const std::size_t end = list.find_first_of(",-]", open);
  const std::size_t close = list.find(']', open);
  if (end == std::string::npos || close == std::string::npos) {
    throw EnvironmentError("SLURM_STEP_NODELIST", "'" + list.substr(0, 40) + "'; expected hosts");
  }
  const std::size_t after = list.find(',', close);
  const std::string rest =
      list.substr(close + 1, after == std::string::npos ? after : after - close - 1);
  return list.substr(0, open) + list.substr(open + 1, end - open - 1) + rest;
}

}  // namespace atelier
