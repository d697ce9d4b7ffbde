#pragma once

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/support/child_process.h"
#include "tests/support/places.h"

namespace atelier::fixtures {

/// A server as a test talks to it.
class Server {
 public:
  explicit Server(const std::filesystem::path& place, const std::filesystem::path& log)
      : child_({"sh", "-c", "exec \"$0\" view \"$1\" > \"$2\"", program_path(), place.string(),
                log.string()}) {
    constexpr int kTries = 600;
    for (int i = 0; i < kTries && address_.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      std::ifstream file(log);
      std::string line;
      while (std::getline(file, line)) {
        if (line.starts_with("http://") && !file.eof()) {
          address_ = line;
        }
      }
    }
    const std::size_t port = address_.find_last_of(':');
    if (port != std::string::npos) {
      port_ = std::atoi(address_.c_str() + port + 1);
      path_ = address_.substr(address_.find('/', port));
    }
  }
  ~Server() { child_.kill(SIGTERM); }
  const std::string& address() const { return address_; }
  const std::string& path() const { return path_; }
  int port() const { return port_; }
  std::string get(const std::string& path, const std::string& more = "",
                  const std::string& host = "127.0.0.1") const {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(static_cast<std::uint16_t>(port_));
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket, reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
    const std::string request = "GET " + path + " HTTP/1.1\r\nHost: " + host + ":" +
                                std::to_string(port_) + "\r\nConnection: close\r\n" + more + "\r\n";
    EXPECT_EQ(write(socket, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    std::string answer;
    char piece[4096];
    for (ssize_t got = 0; (got = read(socket, piece, sizeof piece)) > 0;) {
      answer.append(piece, static_cast<std::size_t>(got));
    }
    close(socket);
    return answer;
  }

 private:
  ChildProcess child_;
  std::string address_;
  std::string path_;
  int port_ = 0;
};

}  // namespace atelier::fixtures
