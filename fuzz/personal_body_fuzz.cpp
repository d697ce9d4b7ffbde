#include "bodymodel/formats/personal_body.h"
#include "fuzz/body_arrays.h"
#include "fuzz/reader.h"

/// One person's body; what is read is valid and can be written.
ATELIER_FUZZ_READER(personal_body) {
  const atelier::PersonalBody person = atelier::personal_body_of_arrays(body_npz(
      bytes,
      {{"shape_names", {}}, {"shape_units", {}}, {"person_shape_names", {"stature", "mass"}}}));
  atelier::check_personal_body(person);
  atelier::personal_body_arrays(person);
}
