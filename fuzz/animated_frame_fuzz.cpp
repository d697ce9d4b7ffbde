#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"
#include "simulation/animated_frame.h"

/// A frame of clothes of four vertices with its figures; what is read can be written and reads the
/// same.
ATELIER_FUZZ_READER(animated_frame) {
  const atelier::AnimatedFrame frame =
      atelier::animated_frame_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                        "atelier.animated_frame", 1, "frame"),
                                 4, "frame");
  ATELIER_CHECK(frame.state.positions.allFinite() && frame.state.velocities.allFinite(),
                "a frame from which an animation can go on");
  const atelier::AnimatedFrame again =
      atelier::animated_frame_of(atelier::archive_of(frame), 4, "written");
  ATELIER_CHECK(again.state.positions == frame.state.positions &&
                    again.state.velocities == frame.state.velocities &&
                    again.state.frame == frame.state.frame,
                "a state reads back as it was");
  for (const auto& [name, member] : atelier::kFrameFigures) {
    ATELIER_CHECK(frame.figures.*member >= 0 && again.figures.*member == frame.figures.*member,
                  "a figure reads back as it was");
  }
}
