#include "capture/layouts/easymocap.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"
#include "fuzz/two_texts.h"

ATELIER_FUZZ_READER(easymocap) {
  const auto [intrinsics, extrinsics] = two_texts(bytes);
  check_finite_cameras(parse_easymocap_cameras(intrinsics, extrinsics));
}
