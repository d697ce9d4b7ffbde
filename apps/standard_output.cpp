#include "apps/standard_output.h"

#include <cstdio>
#include <iostream>

#include <fcntl.h>
#include <unistd.h>

namespace atelier {

StandardOutput::StandardOutput() {
  std::cout.flush();
  std::fflush(stdout);
  const int own = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (own >= 0 && nowhere >= 0 && dup2(nowhere, STDOUT_FILENO) >= 0) {
    own_ = __gnu_cxx::stdio_filebuf<char>(own, std::ios::out);
    before_ = std::cout.rdbuf(&own_);
  } else if (own >= 0) {
    close(own);
  }
  if (nowhere >= 0) {
    close(nowhere);
  }
}

StandardOutput::~StandardOutput() {
  if (before_ != nullptr) {
    own_.pubsync();
    std::fflush(stdout);  // what others printed waits in stdio until here
    dup2(own_.fd(), STDOUT_FILENO);
    std::cout.rdbuf(before_);
  }
}

}  // namespace atelier
