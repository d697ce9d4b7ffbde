#pragma once

#include <map>
#include <mutex>
#include <utility>

namespace atelier {

/// Data of frames that a stage needs at its end. They are kept as the frames are made, so that
/// nothing is read back but frames of an earlier run or another shard.
template <class Value>
class FrameMemory {
 public:
  /// From any thread.
  void keep(int frame_id, Value value) {
    const std::lock_guard lock(mutex_);
    values_[frame_id] = std::move(value);
  }
  /// The data kept of a frame, which are then released; or the result of `read` on its file.
  template <class Read>
  Value take(int frame_id, const Read& read) {
    const std::lock_guard lock(mutex_);
    const auto found = values_.find(frame_id);
    if (found == values_.end()) {
      return read();
    }
    Value value = std::move(found->second);
    values_.erase(found);
    return value;
  }

 private:
  std::mutex mutex_;
  std::map<int, Value> values_;
};

}  // namespace atelier
