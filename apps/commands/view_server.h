#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "pipeline/view/view_page.h"

namespace atelier {

/// 32 hexadecimal digits that nobody can guess. Throws EnvironmentError where the system has no
/// randomness.
std::string random_token();

/// Serves a page on this machine alone (127.0.0.1), to whoever knows the token that its address
/// begins with: other users of the machine, and pages of others in the same browser, do not. Only
/// the page's files are there; no path leads to anything else.
class ViewServer {
 public:
  /// @param port  0: any that is free
  /// Throws EnvironmentError where the port is taken.
  ViewServer(ViewPage page, int port);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// "http://127.0.0.1:4567/0123.../".
  std::string address() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
