#include "capture/layouts/mvhumannet.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"
#include "fuzz/two_texts.h"

ATELIER_FUZZ_READER(mvhumannet) {
  static_cast<void>(pickled_number(bytes));
  const auto [intrinsics, extrinsics] = two_texts(bytes);
  check_finite_cameras(parse_mvhumannet_cameras(intrinsics, extrinsics));
}
