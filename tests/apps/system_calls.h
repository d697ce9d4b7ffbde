#pragma once

#include <algorithm>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <sched.h>

#include "core/io/file_bytes.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {

/// One system call of a run: its name and how many of that name came before it, from 1.
struct SystemCall {
  std::string name;
  int number = 0;
  bool after_swap = false;  ///< `current` led to the new result by then
};

/// True if strace can trace and inject here (containers may forbid it).
inline bool can_inject() {
  const ChildResult result = run_child(
      {"strace", "-f", "-o", "/dev/null", "-e", "inject=write:error=ENOSPC:when=1", "true"});
  return result.exit_code == 0;
}

/// strace, which stops the program at the calls that it traces alone: stops at all of them, the
/// loader's too, take half of a run's time. Signals it injects only where it stops at all.
inline std::vector<std::string> traced_into(const std::string& log, bool every_call = false) {
  std::vector<std::string> traced = {"strace", "-f", "-o", log};
  if (!every_call) {
    traced.push_back("--seccomp-bpf");
  }
  return traced;
}

/// The command on one processor. strace counts the calls of each thread apart, and which thread of
/// several digests an input is chance: the number of a call would be another one in the next run.
inline std::vector<std::string> on_one_processor(const std::vector<std::string>& command) {
  std::vector<std::string> result = {"taskset", "--cpu-list", std::to_string(sched_getcpu())};
  result.insert(result.end(), command.begin(), command.end());
  return result;
}

/// The calls by which a run changes the disk, in order, from the first mkdir on (what comes before
/// is the program being loaded).
inline std::vector<SystemCall> record_calls(const std::vector<std::string>& command,
                                            const std::vector<std::string>& names) {
  const TemporaryDirectory folder;
  const std::string log = (folder / "calls").string();
  std::string list;
  for (const std::string& name : names) {
    list += (list.empty() ? "" : ",") + name;
  }
  std::vector<std::string> traced = traced_into(log);
  traced.insert(traced.end(), {"-e", "trace=" + list + ",mkdir,rename"});
  const std::vector<std::string> alone = on_one_processor(command);
  traced.insert(traced.end(), alone.begin(), alone.end());
  run_child(traced);
  std::vector<SystemCall> calls;
  std::map<std::string, int> counts;
  bool working = false;
  bool swapped = false;
  std::istringstream lines(read_file_text(log, 1 << 26));
  for (std::string line; std::getline(lines, line);) {
    // "12345 write(3, ..." ; "12345 <... write resumed>" was counted when it began.
    const std::size_t begin = line.find(' ');
    const std::size_t end = line.find('(');
    if (begin == std::string::npos || end == std::string::npos || end < begin) {
      continue;
    }
    std::string name = line.substr(begin + 1, end - begin - 1);
    name.erase(0, name.find_first_not_of(' '));
    working = working || name == "mkdir";
    ++counts[name];
    if (working && std::find(names.begin(), names.end(), name) != names.end()) {
      calls.push_back({name, counts[name], swapped});
    }
    swapped = swapped || (name == "rename" && line.find("/current\")") != std::string::npos);
  }
  return calls;
}

/// The command under strace, with one thing done at one call: "signal=KILL" or "error=ENOSPC".
inline std::vector<std::string> injected(const std::vector<std::string>& command,
                                         const SystemCall& call, const std::string& what) {
  std::vector<std::string> traced = traced_into("/dev/null", what.starts_with("signal="));
  traced.insert(traced.end(),
                {"-e", "trace=" + call.name, "-e",
                 "inject=" + call.name + ":" + what + ":when=" + std::to_string(call.number)});
  const std::vector<std::string> alone = on_one_processor(command);
  traced.insert(traced.end(), alone.begin(), alone.end());
  return traced;
}

/// Every how many-th injection the ordinary tests try; ATELIER_SOAK=1 tries all.
inline int injection_stride(int sampled) {
  const char* soak = std::getenv("ATELIER_SOAK");
  return soak != nullptr && std::string(soak) == "1" ? 1 : sampled;
}

}  // namespace atelier::fixtures
