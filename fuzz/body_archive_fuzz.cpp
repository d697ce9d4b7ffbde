#include "bodymodel/formats/body_archive.h"
#include "fuzz/body_arrays.h"
#include "fuzz/reader.h"

/// Atelier's own bodies and motions; what is read can be written.
ATELIER_FUZZ_READER(body_archive) {
  const atelier::Npz npz = body_npz(bytes);
  if (atelier::archive_schema(npz) == "atelier-motion-1") {
    atelier::motion_arrays(atelier::motion_of_arrays(npz));
  } else {
    atelier::body_arrays(atelier::body_of_arrays(npz));
  }
}
