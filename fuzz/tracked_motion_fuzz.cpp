#include "bodymodel/formats/tracked_motion.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// Poses of a person that were found in a capture; what is read can be written and reads the same.
ATELIER_FUZZ_READER(tracked_motion) {
  const atelier::TrackedMotion tracked =
      atelier::tracked_motion_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                        "atelier.tracked", 1, "tracked"),
                                 "tracked");
  const atelier::TrackedMotion again =
      atelier::tracked_motion_of(atelier::archive_of(tracked), "written");
  ATELIER_CHECK(again.motion.frame_ids == tracked.motion.frame_ids &&
                    again.joints == tracked.joints && again.trusted == tracked.trusted &&
                    again.region == tracked.region,
                "a motion reads back as it was");
}
