#include "core/io/child_program.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "core/exit_code.h"
#include "core/not_converged.h"
#include "core/system_reason.h"

extern char** environ;  // NOLINT(readability-identifier-naming): POSIX

namespace atelier {
namespace {

/// Both ends of a pipe, closed in the end.
struct Pipe {
  std::array<int, 2> ends{-1, -1};
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) {
      throw EnvironmentError("pipe", system_reason(errno));
    }
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_end(std::size_t end) {
    if (ends.at(end) >= 0) {
      close(ends.at(end));
      ends.at(end) = -1;
    }
  }
};

/// Appends what is there to read; false at the end.
bool read_some(int descriptor, std::string& text) {
  std::array<char, 4096> buffer{};
  const ssize_t count = read(descriptor, buffer.data(), buffer.size());
  if (count > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return count > 0 || (count < 0 && (errno == EINTR || errno == EAGAIN));
}

/// "": that of this program.
std::filesystem::path& program_folder() {
  static std::filesystem::path folder;
  return folder;
}

std::filesystem::path program_beside(const std::string& name) {
  const std::filesystem::path& folder = program_folder();
  return (folder.empty() ? std::filesystem::read_symlink("/proc/self/exe").parent_path() : folder) /
         name;
}

[[noreturn]] void fail(const std::string& name, int status, std::string text) {
  const std::string prefix = name + ": ";
  if (text.starts_with(prefix)) {
    text.erase(0, prefix.size());
  }
  while (!text.empty() && text.back() == '\n') {
    text.pop_back();
  }
  if (WIFSIGNALED(status)) {
    throw EnvironmentError(name, "ended by signal " + std::to_string(WTERMSIG(status)) +
                                     (text.empty() ? "" : ": " + text));
  }
  switch (WEXITSTATUS(status)) {
    case kExitBadData: {
      // It has said what it expected, if anything, as DataError does.
      const std::string expected = "; expected ";
      const std::size_t at = text.find(expected);
      throw DataError(
          "", name, text.substr(0, at),
          at == std::string::npos ? "data that it can use" : text.substr(at + expected.size()));
    }
    case kExitNotConverged:
      throw NotConverged(prefix + text);
    case kExitEnvironment:
      throw EnvironmentError(name, text);
    default:
      throw LogicError(prefix + text);
  }
}

}  // namespace

void set_program_folder(const std::filesystem::path& folder) {
  program_folder() = folder;
}

bool has_child_program(const std::string& name) {
  return access(program_beside(name).c_str(), X_OK) == 0;
}

bool run_child_program(const std::string& name, const std::vector<std::string>& arguments,
                       const std::string& missing,
                       const std::function<void(const std::string& line)>& on_line,
                       const std::function<bool()>& stop) {
  const std::filesystem::path program = program_beside(name);
  if (access(program.c_str(), X_OK) != 0) {
    throw EnvironmentError(program.string(),
                           std::generic_category().message(errno) + "; " + missing);
  }
  std::vector<std::string> words = {program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) {
    pointers.push_back(word.data());
  }
  pointers.push_back(nullptr);
  Pipe out;
  Pipe errors;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out.ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.ends[1], STDERR_FILENO);
  pid_t child = 0;
  const int spawned =
      posix_spawn(&child, program.c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (spawned != 0) {
    throw EnvironmentError(program.string(), system_reason(spawned));
  }
  out.close_end(1);
  errors.close_end(1);
  std::string text;
  std::string said;
  bool told = false;
  std::array<pollfd, 2> watched = {{{out.ends[0], POLLIN, 0}, {errors.ends[0], POLLIN, 0}}};
  constexpr int kWait = 200;  // ms between looks at `stop`
  while (watched[0].fd >= 0 || watched[1].fd >= 0) {
    poll(watched.data(), watched.size(), kWait);
    if (watched[0].revents != 0 && !read_some(watched[0].fd, text)) {
      watched[0].fd = -1;
    }
    if (watched[1].revents != 0 && !read_some(watched[1].fd, said)) {
      watched[1].fd = -1;
    }
    for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
      on_line(text.substr(0, end));
      text.erase(0, end + 1);
    }
    if (!told && stop()) {
      kill(child, SIGTERM);
      told = true;
    }
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const bool done = WIFEXITED(status) && WEXITSTATUS(status) == kExitDone;
  if (told) {
    return false;
  }
  if (!done) {
    fail(name, status, said);
  }
  return true;
}

}  // namespace atelier
