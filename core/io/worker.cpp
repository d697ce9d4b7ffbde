#include "core/io/worker.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <mutex>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "core/hdf5_lock.h"
#include "core/io/byte_reader.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr int kPipe = 3;  ///< the only descriptor of the child beside the standard ones
constexpr std::byte kResult{1};
constexpr std::byte kRefusal{2};

// --- in the child -------------------------------------------------------------------------------

void limit(int resource, std::uint64_t value, std::uint64_t hard_margin = 0) {
  const rlimit ceiling{value, value + hard_margin};
  setrlimit(static_cast<__rlimit_resource_t>(resource), &ceiling);
}

std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

#if defined(__x86_64__)
/// Everything but these calls fails with EPERM; writing works on the pipe and on standard error.
void allow_few_calls() {
  constexpr std::array kAllowed = {
      SYS_read,           SYS_brk,          SYS_mmap,           SYS_munmap,        SYS_mremap,
      SYS_mprotect,       SYS_madvise,      SYS_exit,           SYS_exit_group,    SYS_rt_sigaction,
      SYS_rt_sigprocmask, SYS_rt_sigreturn, SYS_sigaltstack,    SYS_futex,         SYS_sched_yield,
      SYS_getpid,         SYS_gettid,       SYS_tgkill,         SYS_clock_gettime, SYS_gettimeofday,
      SYS_getrandom,      SYS_getrusage,    SYS_restart_syscall};
  constexpr auto kNumber = static_cast<std::uint32_t>(offsetof(seccomp_data, nr));
  constexpr auto kMachine = static_cast<std::uint32_t>(offsetof(seccomp_data, arch));
  constexpr auto kFirstArgument = static_cast<std::uint32_t>(offsetof(seccomp_data, args));
  std::vector<sock_filter> program = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kMachine),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AUDIT_ARCH_X86_64, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kNumber),
  };
  for (const auto call : kAllowed) {
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1));
    program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  program.insert(program.end(), {BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_write, 0, 4),
                                 BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFirstArgument),
                                 BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kPipe, 1, 0),
                                 BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, STDERR_FILENO, 0, 1),
                                 BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
                                 BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM)});
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter);
}
#else
void allow_few_calls() {}
#endif

/// Gives up what the child does not need. What fails here is only a line of defence less.
void confine(const Limits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  prctl(PR_SET_DUMPABLE, 0);
  limit(RLIMIT_AS, address_space() + static_cast<std::uint64_t>(limits.worker_memory_bytes));
  // The margin: the first signal is one that can be told from others.
  limit(RLIMIT_CPU, static_cast<std::uint64_t>(limits.worker_cpu_seconds), 1);
  limit(RLIMIT_FSIZE, 0);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, 0);
  allow_few_calls();
}

bool write_all(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(kPipe, bytes.data(), bytes.size());
    if (count < 0 && errno != EINTR) {
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  }
  return true;
}

std::vector<std::byte> refusal_bytes(const DataError& error) {
  std::vector<std::byte> bytes = {kRefusal};
  for (const std::string* text : {&error.where, &error.found, &error.expected}) {
    const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(text->size(), 4096));
    const auto raw = std::as_bytes(std::span(&size, 1));
    const auto view = std::as_bytes(std::span(text->data(), size));
    bytes.insert(bytes.end(), raw.begin(), raw.end());
    bytes.insert(bytes.end(), view.begin(), view.end());
  }
  return bytes;
}

/// The whole life of the child. Never returns: its destructors and exit handlers are the parent's.
[[noreturn]] void live(int pipe_end, const std::function<std::vector<std::byte>()>& work,
                       const std::string& file, const Limits& limits) {
  if (pipe_end != kPipe) {
    dup2(pipe_end, kPipe);
  }
  syscall(SYS_close_range, kPipe + 1, ~0u, 0);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);  // a warning that a library prints into a log file fails, and no more
  std::vector<std::byte> reply;
  try {
    confine(limits);
    reply = work();
    reply.insert(reply.begin(), kResult);
  } catch (const DataError& error) {
    reply = refusal_bytes(error);
  } catch (const std::bad_alloc&) {
    reply = refusal_bytes(DataError(
        file, "", "more than " + std::to_string(limits.worker_memory_bytes >> 20) + " MB of memory",
        "less"));
  }
  _exit(write_all(reply) ? 0 : 1);
}

// --- in the parent ------------------------------------------------------------------------------

/// Reads until the end of the pipe, a ceiling or a deadline; false if the child is to be stopped.
bool read_all(int pipe_end, std::uint64_t most, std::chrono::seconds patience,
              std::vector<std::byte>& bytes) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::vector<std::byte> buffer(std::size_t{64} << 10);
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    pollfd waiting{pipe_end, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready < 0 && errno == EINTR) {
      continue;
    }
    if (ready <= 0) {
      return false;
    }
    const ssize_t count = ::read(pipe_end, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count <= 0) {
      return count == 0;
    }
    if (bytes.size() + static_cast<std::size_t>(count) > most) {
      return false;
    }
    bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + count);
  }
}

std::string death_of(int status, const Limits& limits) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    return "reading it took more than " + std::to_string(limits.worker_cpu_seconds) +
           " s of processor time";
  }
  if (WIFSIGNALED(status)) {
    return std::string("the process that read it died: ") + strsignal(WTERMSIG(status));
  }
  return "the process that read it failed";
}

}  // namespace

std::vector<std::byte> run_in_worker(const std::function<std::vector<std::byte>()>& work,
                                     const std::string& file, const Limits& limits) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw EnvironmentError(file, "no pipe for a worker: " + system_reason(errno));
  }
  pid_t child = -1;
  {
    // No thread may be inside HDF5 now: the child would inherit its half-done state.
    const std::lock_guard lock(hdf5_mutex());
    child = fork();
  }
  if (child < 0) {
    const int error = errno;
    close(ends[0]);
    close(ends[1]);
    throw EnvironmentError(file, "no worker: " + system_reason(error));
  }
  if (child == 0) {
    live(ends[1], work, file, limits);
  }
  close(ends[1]);
  std::vector<std::byte> reply;
  // Time on the wall is for a child that waits for something that never comes.
  const bool complete =
      read_all(ends[0], static_cast<std::uint64_t>(limits.tensor_bytes) + (1u << 20),
               std::chrono::seconds(6 * limits.worker_cpu_seconds), reply);
  close(ends[0]);
  if (!complete) {
    kill(child, SIGKILL);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!complete || !WIFEXITED(status) || WEXITSTATUS(status) != 0 || reply.empty()) {
    throw DataError(file, "",
                    complete ? death_of(status, limits) : "reading it did not come to an end",
                    "a sound file");
  }
  const std::byte kind = reply.front();
  reply.erase(reply.begin());
  if (kind == kResult) {
    return reply;
  }
  ByteReader reader(reply, "worker");
  std::array<std::string, 3> texts;
  for (std::string& text : texts) {
    text = reader.text(reader.little<std::uint32_t>("length"), "text");
  }
  throw DataError(file, texts[0], texts[1], texts[2]);
}

}  // namespace atelier
