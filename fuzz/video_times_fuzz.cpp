#include <algorithm>

#include "capture/video_times.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(video_times) {
  const auto times = atelier::read_video_times(bytes, "video_times");
  if (times) {
    ATELIER_CHECK(std::is_sorted(times->ticks.begin(), times->ticks.end()), "times out of order");
    atelier::video_findings(*times, "video_times");
  }
}
