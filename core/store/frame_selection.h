#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// Which frames of a frame-wise stage a run does: those of a range of frame numbers that fall to
/// its shard. Others' frames are left to other runs.
struct FrameSelection {
  std::optional<int> begin;  ///< first frame number, the capture's own
  std::optional<int> end;    ///< one after the last
  int shard = 0;             ///< 0 ... shards - 1
  int shards = 1;            ///< every shards-th frame of the list is this run's

  bool everything() const { return !begin && !end && shards == 1; }
};

/// Sets the range from "a:b", "a:", ":b" or "a". Returns "" or what is wrong, in one sentence.
std::string set_frames(FrameSelection& selection, std::string_view text);

/// Sets the shard from "i/n", i in [0, n). Returns "" or what is wrong, in one sentence.
std::string set_shard(FrameSelection& selection, std::string_view text);

/// Those of `frame_ids` that are selected, in their order.
std::vector<int> selected_frames(const FrameSelection& selection,
                                 const std::vector<int>& frame_ids);

/// The same, but throws UnknownValue that names `input` where frames are there and none of them is
/// in the range. A shard may have none: a cluster starts as many as it likes.
std::vector<int> some_selected_frames(const FrameSelection& selection,
                                      const std::vector<int>& frame_ids, const std::string& input);

/// "frames 0:10 of shard 1/4"; "every frame".
std::string to_string(const FrameSelection& selection);

}  // namespace atelier
