#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"
#include "simulation/simulation_table.h"

/// A frame of a cloth of four vertices with its report; what is read can be written and reads the
/// same.
ATELIER_FUZZ_READER(simulated_frame) {
  const atelier::SimulatedFrame frame =
      atelier::simulated_frame_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                         "atelier.simulated_frame", 1, "frame"),
                                  4, "frame");
  ATELIER_CHECK(frame.state.positions.allFinite() && frame.state.velocities.allFinite() &&
                    frame.report.frame == frame.state.frame,
                "a frame from which a simulation can go on");
  const atelier::SimulatedFrame again =
      atelier::simulated_frame_of(atelier::archive_of(frame), 4, "written");
  ATELIER_CHECK(again.state.positions == frame.state.positions &&
                    again.state.velocities == frame.state.velocities,
                "a state reads back as it was");
  ATELIER_CHECK(atelier::frames_csv({again.report}, 24) == atelier::frames_csv({frame.report}, 24),
                "a report reads back as it was");
}
