#include "core/garment_archive.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// What is read can be written, and then says the same.
ATELIER_FUZZ_READER(garment) {
  const atelier::Archive archive = atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                          "atelier.garment", 1, "garment");
  const atelier::Garment garment = atelier::garment_of(archive, "garment");
  const atelier::Garment again = atelier::garment_of(atelier::archive_of(garment), "written");
  ATELIER_CHECK(again.boundaries == garment.boundaries &&
                    again.attachments.size() == garment.attachments.size() &&
                    again.seams.size() == garment.seams.size() && again.name == garment.name &&
                    atelier::equal_arrays(again.mesh.vertices, garment.mesh.vertices),
                "a garment reads back as it was");
}
