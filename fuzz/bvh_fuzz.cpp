#include "bodymodel/formats/motion_bvh.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(bvh) {
  const atelier::MotionClip clip = atelier::read_bvh(bytes, "bvh");
  atelier::check_motion_clip(clip, "bvh");
}
