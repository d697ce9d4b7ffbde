#pragma once

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace atelier::fixtures {

/// How a program ended and what it wrote.
struct ChildResult {
  int exit_code = -1;  ///< -1 if a signal ended it
  int signal = 0;      ///< 0 if it exited
  std::string out;
  std::string err;
};

/// A program that runs beside the test; killed if it still runs at the end of the scope.
class ChildProcess {
 public:
  explicit ChildProcess(const std::vector<std::string>& command) {
    std::array<int, 2> out{};
    std::array<int, 2> err{};
    if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) {
      throw std::runtime_error("pipe failed");
    }
    std::vector<char*> arguments;
    for (const std::string& word : command) {
      arguments.push_back(const_cast<char*>(word.c_str()));
    }
    arguments.push_back(nullptr);
    pid_ = fork();
    if (pid_ < 0) {
      throw std::runtime_error("fork failed");
    }
    if (pid_ == 0) {
      // Tests that run in the background ignore interrupts; what they start must not.
      for (const int one : {SIGINT, SIGQUIT, SIGHUP, SIGTERM}) {
        signal(one, SIG_DFL);
      }
      const int nothing = open("/dev/null", O_RDONLY);
      dup2(nothing, 0);
      dup2(out[1], 1);
      dup2(err[1], 2);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
    close(out[1]);
    close(err[1]);
    out_ = out[0];
    err_ = err[0];
  }
  ~ChildProcess() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(out_);
    close(err_);
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void kill(int signal) const { ::kill(pid_, signal); }
  /// True once it has ended, by itself or by a signal; `wait` still gets its result.
  bool has_ended() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
  }
  pid_t pid() const { return pid_; }
  /// True once it has a handler of its own for a signal.
  bool catches(int signal) const {
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("SigCgt:")) {
        return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
      }
    }
    return false;
  }

  /// Reads both streams to their ends and waits.
  ChildResult wait() {
    ChildResult result;
    fd_set open_streams;
    bool out_open = true;
    bool err_open = true;
    std::array<char, 4096> chunk{};
    while (out_open || err_open) {
      FD_ZERO(&open_streams);
      if (out_open) {
        FD_SET(out_, &open_streams);
      }
      if (err_open) {
        FD_SET(err_, &open_streams);
      }
      if (select(std::max(out_, err_) + 1, &open_streams, nullptr, nullptr, nullptr) < 0) {
        continue;
      }
      const auto drain = [&](int stream, bool& is_open, std::string& text) {
        if (is_open && FD_ISSET(stream, &open_streams)) {
          const ssize_t got = ::read(stream, chunk.data(), chunk.size());
          is_open = got > 0;
          text.append(chunk.data(), got > 0 ? static_cast<std::size_t>(got) : 0);
        }
      };
      drain(out_, out_open, result.out);
      drain(err_, err_open, result.err);
    }
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    if (WIFEXITED(status)) {
      result.exit_code = WEXITSTATUS(status);
    } else if (WIFSIGNALED(status)) {
      result.signal = WTERMSIG(status);
    }
    return result;
  }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
  int err_ = -1;
};

/// Runs a program to its end.
inline ChildResult run_child(const std::vector<std::string>& command) {
  return ChildProcess(command).wait();
}

}  // namespace atelier::fixtures
