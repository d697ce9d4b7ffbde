#pragma once

#include <functional>
#include <string>

namespace atelier {

/// Where a process stands among those that train one network together.
struct PeerPlace {
  int rank = 0;            ///< 0..size - 1
  int size = 1;            ///< number of processes
  int local_rank = 0;      ///< rank among those of the same machine, and the number of its GPU
  std::string rendezvous;  ///< "tcp://HOST:PORT" of rank 0, or a file that all of them see
};

/// The value of an environment variable; "" where it is not set.
using EnvironmentVariables = std::function<std::string(const std::string& name)>;

/// The place that torchrun gives a process that it starts: RANK, WORLD_SIZE, LOCAL_RANK,
/// MASTER_ADDR and MASTER_PORT. Throws EnvironmentError, naming the variable, for one that is not
/// set or no number in range.
PeerPlace torchrun_place(const EnvironmentVariables& environment);

/// The place that Slurm's srun gives a task: SLURM_PROCID, SLURM_NTASKS, SLURM_LOCALID; rank 0 is
/// on the first node of SLURM_STEP_NODELIST, at a port that follows from SLURM_JOB_ID, where
/// MASTER_ADDR and MASTER_PORT do not say otherwise. Throws as torchrun_place does.
PeerPlace slurm_place(const EnvironmentVariables& environment);

/// The first host of a list as Slurm writes it: "gpu[03-07,9],login" begins with gpu03.
std::string first_host(const std::string& list);

}  // namespace atelier
