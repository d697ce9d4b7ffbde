#include "bodymodel/formats/smpl.h"
#include "fuzz/npz_arrays.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(smpl) {
  const atelier::BodyModel model = atelier::read_smpl(atelier::fuzz::npz_of(bytes, "smpl")).model;
  atelier::check_body_model(model, "smpl");
}
