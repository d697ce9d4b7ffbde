#include "core/store/digest_meter.h"

#include <algorithm>

namespace atelier {

void DigestMeter::expect(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  total_ += bytes;
}

void DigestMeter::add(std::int64_t bytes) {
  if (events_ == nullptr) {
    return;
  }
  const std::lock_guard lock(mutex_);
  done_ += bytes;
  if (stopped_ || (events_->stop && events_->stop())) {
    stopped_ = true;
    throw StopRequested();
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (events_->progress && seconds > quiet_seconds_) {
    // A file that grows while it is read has more bytes than were expected.
    const std::int64_t total = std::max(done_, total_);
    const double rate = static_cast<double>(done_) / seconds;
    events_->progress({kDigestUnit, done_, total, rate,
                       rate > 0 ? static_cast<double>(total - done_) / rate : 0.0});
  }
}

}  // namespace atelier
