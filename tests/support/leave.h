#pragma once

// How a forked child of a test ends: at once, without the destructors and exit handlers that are
// its parent's. In a coverage build the lines that it ran are written first, which a bare _exit
// loses; a (soft) limit of file size that the test had set is lifted for that.

#include <sys/resource.h>
#include <unistd.h>

#ifdef ATELIER_COVERAGE
extern "C" void __gcov_dump();
#endif

namespace atelier::fixtures {

[[noreturn]] inline void leave(int code) {
#ifdef ATELIER_COVERAGE
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_FSIZE, &limit);
  __gcov_dump();
#endif
  _exit(code);
}

}  // namespace atelier::fixtures
