#include "apps/console/interrupt.h"

#include <csignal>
#include <cstdlib>
#include <initializer_list>

#include "core/exit_code.h"

namespace atelier {
namespace {

// The only state a signal handler may touch.
volatile std::sig_atomic_t caught_signal = 0;

extern "C" void note_signal(int signal) {
  if (caught_signal != 0) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
  caught_signal = signal;
}

}  // namespace

void catch_interrupts() {
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction now {};
    // A signal that was ignored when the program was started (by "&" in a script) stays ignored.
    if (sigaction(signal, nullptr, &now) != 0 || now.sa_handler != SIG_IGN) {
      std::signal(signal, note_signal);
    }
  }
}

void release_interrupts() {
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction now {};
    if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler == note_signal) {
      std::signal(signal, SIG_DFL);
    }
  }
}

bool interrupted() {
  return caught_signal != 0;
}

void end_by_signal() {
  std::signal(caught_signal, SIG_DFL);
  std::raise(caught_signal);
  std::_Exit(kExitEnvironment);  // only if the signal is blocked
}

}  // namespace atelier
