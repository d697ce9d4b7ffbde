#include "apps/commands/view_server.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <thread>
#include <utility>

#include <httplib.h>
#include <sys/random.h>

#include "core/error.h"
#include "core/system_reason.h"
#include "pipeline/view/view_address.h"

namespace atelier {

namespace {

/// What the page may do: nothing but with its own files. The page states the same of itself, for
/// where it lies on a disk.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "media-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Hands out bytes in pieces of any range. Through a provider: a body would be compressed, and
/// what is in these files is already.
void give(httplib::Response& response, const std::string& type, std::string bytes) {
  const auto shared = std::make_shared<const std::string>(std::move(bytes));
  response.set_content_provider(
      shared->size(), type,
      [shared](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        return sink.write(shared->data() + offset, length);
      });
}

void give_file(httplib::Response& response, const std::string& type,
               const std::filesystem::path& path) {
  const auto file = std::make_shared<std::ifstream>(path, std::ios::binary | std::ios::ate);
  if (!*file) {
    response.status = 404;
    return;
  }
  response.set_content_provider(
      static_cast<std::size_t>(file->tellg()), type,
      [file](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        std::array<char, std::size_t{1} << 16U> piece{};
        const std::size_t wanted = std::min(length, piece.size());
        file->seekg(static_cast<std::streamoff>(offset));
        file->read(piece.data(), static_cast<std::streamsize>(wanted));
        return file->gcount() > 0 &&
               sink.write(piece.data(), static_cast<std::size_t>(file->gcount()));
      });
}

}  // namespace

struct ViewServer::State {
  ViewPage page;
  std::string token;
  int port = 0;
  httplib::Server server;
  std::thread thread;

  /// Whether no range that is asked for begins within so many bytes.
  static bool is_beyond(const httplib::Request& request, std::uintmax_t size) {
    return !request.ranges.empty() &&
           std::all_of(request.ranges.begin(), request.ranges.end(), [&](const auto& range) {
             return range.first >= 0 && static_cast<std::uintmax_t>(range.first) >= size;
           });
  }

  void answer(const httplib::Request& request, httplib::Response& response) const {
    response.set_header("Content-Security-Policy", kPolicy);
    response.set_header("Referrer-Policy", "no-referrer");  // it would hold the token
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Cross-Origin-Resource-Policy", "same-origin");
    response.set_header("Cache-Control", "no-store");
    const std::string host = request.get_header_value("Host");
    const std::string own = ":" + std::to_string(port);
    const bool here = host == "127.0.0.1" + own || host == "localhost" + own;
    const std::optional<std::string> name = here ? page_file_of(request.path, token) : std::nullopt;
    const auto file = name ? page.find(*name) : page.end();
    if (file == page.end()) {  // the same for a wrong token as for a file that is not there
      response.status = 404;
      return;
    }
    std::string bytes = file->second.bytes ? file->second.bytes() : "";
    std::error_code ignored;  // a file that is gone is told by give_file
    const std::uintmax_t size =
        file->second.bytes ? bytes.size() : std::filesystem::file_size(file->second.path, ignored);
    if (is_beyond(request, size)) {
      response.status = 416;
      response.set_header("Content-Range", "bytes */" + std::to_string(size));
    } else if (file->second.bytes) {
      give(response, file->second.type, std::move(bytes));
    } else {
      give_file(response, file->second.type, file->second.path);
    }
  }
};

std::string random_token() {
  std::array<std::uint8_t, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw EnvironmentError("", "no random numbers: " + system_reason(errno));
  }
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string token;
  for (const std::uint8_t byte : bytes) {
    token += kDigits[byte >> 4U];
    token += kDigits[byte & 15U];
  }
  return token;
}

ViewServer::ViewServer(ViewPage page, int port) : state_(std::make_unique<State>()) {
  state_->page = std::move(page);
  state_->token = random_token();
  httplib::Server& server = state_->server;
  server.set_keep_alive_max_count(10000);
  server.Get(".*",
             [state = state_.get()](const httplib::Request& request, httplib::Response& response) {
               state->answer(request, response);
             });
  const httplib::Server::HandlerWithResponse not_there = [](const httplib::Request& /*request*/,
                                                            httplib::Response& response) {
    if (response.status != 404) {
      return httplib::Server::HandlerResponse::Unhandled;
    }
    response.set_content("there is nothing here: use the address that atelier view printed\n",
                         "text/plain");
    return httplib::Server::HandlerResponse::Handled;
  };
  server.set_error_handler(not_there);
  // Two servers on one port would answer in turn.
  server.set_socket_options([](socket_t /*socket*/) {});
  if (port == 0) {
    state_->port = server.bind_to_any_port("127.0.0.1");
  } else {
    state_->port = server.bind_to_port("127.0.0.1", port) ? port : -1;
  }
  if (state_->port < 0) {
    throw EnvironmentError("127.0.0.1:" + std::to_string(port),
                           "the port cannot be taken: another program may have it; leave out "
                           "--port for any that is free");
  }
  state_->thread = std::thread([&server] { server.listen_after_bind(); });
}

ViewServer::~ViewServer() {
  state_->server.stop();
  state_->thread.join();
}

std::string ViewServer::address() const {
  return "http://127.0.0.1:" + std::to_string(state_->port) + "/" + state_->token + "/";
}

}  // namespace atelier
