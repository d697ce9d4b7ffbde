#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth_state_archive.h"

/// A cloth of four vertices between two frames; what is read is finite, can be written and reads
/// the same.
ATELIER_FUZZ_READER(cloth_state) {
  const atelier::ClothState state =
      atelier::cloth_state_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                     "atelier.cloth_state", 1, "state"),
                              4, "state");
  ATELIER_CHECK(state.positions.allFinite() && state.velocities.allFinite() && state.frame >= 0,
                "a state from which a simulation can go on");
  const atelier::ClothState again =
      atelier::cloth_state_of(atelier::archive_of(state), 4, "written");
  ATELIER_CHECK(again.positions == state.positions && again.velocities == state.velocities &&
                    again.frame == state.frame,
                "a state reads back as it was");
}
