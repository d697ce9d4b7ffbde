#include "core/sequence_archive.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// What the frames of a sequence share; what is read can be written and reads the same.
ATELIER_FUZZ_READER(sequence_header) {
  const atelier::SequenceHeader header =
      atelier::sequence_header_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                         "atelier.sequence", 1, "sequence"),
                                  "sequence");
  for (std::size_t i = 1; i < header.frame_ids.size(); ++i) {
    ATELIER_CHECK(header.frame_ids[i] > header.frame_ids[i - 1], "frames out of order");
  }
  ATELIER_CHECK(header.shared.faces.rows() == 0 || header.shared.faces.minCoeff() >= 0,
                "a face of a vertex below 0");
  const atelier::SequenceHeader again =
      atelier::sequence_header_of(atelier::archive_of(header), "written");
  ATELIER_CHECK(again.fps == header.fps && again.frame_ids == header.frame_ids &&
                    equal_arrays(again.shared.faces, header.shared.faces) &&
                    equal_arrays(again.shared.uvs, header.shared.uvs) &&
                    equal_arrays(again.shared.uv_faces, header.shared.uv_faces),
                "a header reads back as it was");
}
