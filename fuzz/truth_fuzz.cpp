#include "core/io/ground_truth_archive.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// What is read can be written, and then says the same.
ATELIER_FUZZ_READER(truth) {
  const atelier::Archive archive =
      atelier::parse_archive(atelier::fuzz::with_right_digest(bytes), "atelier.truth", 1, "truth");
  const atelier::GroundTruth truth = atelier::truth_of(archive, "truth");
  const atelier::GroundTruth again = atelier::truth_of(atelier::archive_of(truth), "written");
  ATELIER_CHECK(again.garments.size() == truth.garments.size() &&
                    again.cameras.size() == truth.cameras.size() &&
                    again.skeleton.parents == truth.skeleton.parents &&
                    again.body.vertices == truth.body.vertices,
                "a ground truth reads back as it was");
}
