#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>

#include "core/store/stage_events.h"

namespace atelier {

/// Thrown out of the digesting of files when a stop is requested: nothing was changed. Also out of
/// the writing of a capture, of which a part is there.
struct StopRequested : std::exception {
  const char* what() const noexcept override { return "stopped as requested"; }
};

/// The unit of the progress that a DigestMeter tells.
inline constexpr const char* kDigestUnit = "bytes digested";

/// Counts bytes while files are digested, on several threads: tells how far it is and asks whether
/// to stop. The default one does neither.
class DigestMeter {
 public:
  DigestMeter() = default;
  /// `events` must outlive it.
  /// @param quiet_seconds  before which nothing is told: small inputs are not worth a line
  explicit DigestMeter(const StageEvents& events, double quiet_seconds = 1)
      : events_(&events), quiet_seconds_(quiet_seconds) {}

  /// So many more bytes are to come.
  void expect(std::int64_t bytes);
  /// So many more are done. Throws StopRequested.
  void add(std::int64_t bytes);
  /// True once a stop was requested: what has not begun need not begin.
  bool stopped() const { return stopped_; }

 private:
  const StageEvents* events_ = nullptr;
  double quiet_seconds_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
  std::int64_t done_ = 0;
  std::int64_t total_ = 0;
  std::atomic<bool> stopped_ = false;
};

}  // namespace atelier
