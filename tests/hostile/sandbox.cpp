#include "tests/hostile/sandbox.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "tests/support/leave.h"

#if defined(__SANITIZE_ADDRESS__)
// What RLIMIT_AS does in other builds: refuse allocations beyond the ceiling. It cannot be used
// here because the sanitizer maps its shadow of the whole address space. What many small ones add
// up to is seen in the resident memory, of which freed blocks in quarantine may not take much.
// Whole stacks of every allocation would take a third of the time; who looks into a finding asks
// for them with ASAN_OPTIONS=malloc_context_size=30.
extern "C" const char* __asan_default_options() {
  return "max_allocation_size_mb=512:allocator_may_return_null=1:detect_leaks=0:"
         "quarantine_size_mb=16:malloc_context_size=3";
}
#endif

namespace atelier::fixtures {
namespace {

constexpr std::size_t kMemory = std::size_t{512} << 20;
constexpr std::size_t kResident = kMemory + kMemory / 4;  // red zones and shadow take their part
constexpr unsigned kSeconds = 10;

/// What the child tells its parent, also when it dies.
struct Progress {
  std::size_t input = 0;
  char what[512] = {};
};

void limit_memory() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const std::size_t address_space = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const rlimit limit{address_space + kMemory, address_space + kMemory};
  setrlimit(RLIMIT_AS, &limit);
#endif
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
}

/// Bytes, the most that this process has had resident.
std::size_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) << 10;
}

void note(Progress& progress, const char* what) {
  std::snprintf(progress.what, sizeof progress.what, "%s", what);
}

int read_all(const Reader& reader, std::size_t count,
             const std::function<Bytes(std::size_t i)>& input, Progress& progress,
             const std::filesystem::path& log) {
  // Decoders talk about every damaged byte; only what a dying child says is worth reading.
  if (std::freopen(log.c_str(), "w", stderr) == nullptr) {
    return 1;
  }
  limit_memory();
  const std::size_t start = peak_memory();
  for (std::size_t i = 0; i < count; ++i) {
    progress.input = i;
    const Bytes bytes = input(i);
    alarm(kSeconds);
    try {
      reader.read(bytes);
    } catch (const DataError&) {
      // Refused, as it may be.
    } catch (const std::exception& error) {
      note(progress, error.what());
      return 1;
    }
    if (peak_memory() > start + kResident) {
      note(progress, "nothing, but took more memory than it may");
      return 1;
    }
  }
  return 0;
}

/// The last of what a child said, where a sanitizer names the place.
std::string end_of(const std::filesystem::path& log) {
  constexpr std::size_t kShown = 4000;
  std::ifstream file(log);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  return text.size() > kShown ? "..." + text.substr(text.size() - kShown) : text;
}

}  // namespace

std::string read_all_in_sandbox(const Reader& reader, std::size_t count,
                                const std::function<Bytes(std::size_t i)>& input) {
  void* shared =
      mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) {
    return "no shared memory";
  }
  Progress& progress = *new (shared) Progress;
  std::fflush(nullptr);
  const std::filesystem::path log =
      std::filesystem::temp_directory_path() /
      ("hostile-" + reader.name + "-" + std::to_string(getpid()) + ".log");
  const pid_t child = fork();
  if (child < 0) {
    munmap(shared, sizeof(Progress));
    return "cannot fork";
  }
  if (child == 0) {
    // No destructors and no exit handlers: they belong to the parent.
    leave(read_all(reader, count, input, progress, log));
  }
  int status = 0;
  waitpid(child, &status, 0);
  std::string result;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    // Beside the program, not among temporary files: whoever mends the reader wants it.
    const std::filesystem::path folder =
        std::filesystem::canonical("/proc/self/exe").parent_path() / "hostile-failed";
    std::filesystem::create_directories(folder);
    const std::filesystem::path saved =
        folder / (reader.name + "-" + std::to_string(progress.input));
    const Bytes bytes = input(progress.input);
    std::ofstream(saved, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    result = reader.name + ", input " + std::to_string(progress.input) + ": ";
    if (WIFSIGNALED(status)) {
      result += WTERMSIG(status) == SIGALRM
                    ? "took longer than " + std::to_string(kSeconds) + " s"
                    : std::string("died of signal ") + strsignal(WTERMSIG(status));
    } else {
      result += progress.what[0] != '\0' ? std::string("threw ") + progress.what
                                         : "exited with " + std::to_string(WEXITSTATUS(status));
    }
    result += "; saved as " + saved.string() + "; it said: " + end_of(log);
  }
  std::error_code ignored;
  std::filesystem::remove(log, ignored);
  munmap(shared, sizeof(Progress));
  return result;
}

}  // namespace atelier::fixtures
