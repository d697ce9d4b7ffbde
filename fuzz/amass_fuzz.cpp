#include "bodymodel/formats/motion_amass.h"
#include "fuzz/npz_arrays.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(amass) {
  const atelier::MotionClip clip = atelier::read_amass(atelier::fuzz::npz_of(bytes, "amass"));
  atelier::check_motion_clip(clip, "amass");
}
