#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"
#include "pipeline/synthesis/performance_state.h"

/// A cloth of four vertices on a body of three; what is read can be written and reads the same.
ATELIER_FUZZ_READER(synthesis_state) {
  const atelier::PerformanceState state =
      atelier::performance_state_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                           "atelier.synthesis.state", 1, "state"),
                                    4, 3, "state");
  ATELIER_CHECK(state.next_frame >= 0 && state.step >= 0 && state.flesh.steps >= 0 &&
                    state.cloth.positions.allFinite() && state.flesh.offset.allFinite(),
                "a state from which a capture can go on");
  const atelier::PerformanceState again =
      atelier::performance_state_of(atelier::archive_of(state), 4, 3, "written");
  ATELIER_CHECK(again.next_frame == state.next_frame && again.step == state.step &&
                    again.cloth.frame == state.cloth.frame &&
                    again.cloth.positions == state.cloth.positions &&
                    again.cloth.velocities == state.cloth.velocities &&
                    again.flesh.last == state.flesh.last &&
                    again.flesh.last_velocity == state.flesh.last_velocity &&
                    again.flesh.offset == state.flesh.offset &&
                    again.flesh.velocity == state.flesh.velocity,
                "a state reads back as it was");
}
