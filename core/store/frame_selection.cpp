#include "core/store/frame_selection.h"

#include <charconv>

#include "core/error.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

constexpr int kMaxShards = 100'000;

std::optional<int> number_of(std::string_view text) {
  int value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || value < 0) {
    return std::nullopt;
  }
  return value;
}

std::string shown(std::string_view text) {
  return "'" + std::string(text.substr(0, 40)) + "'";
}

}  // namespace

std::string set_frames(FrameSelection& selection, std::string_view text) {
  const std::string problem = "--frames cannot be " + shown(text) +
                              ": it takes a:b, a:, :b or a, frame numbers a <= frame < b";
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) {
    const auto frame = number_of(text);
    if (!frame || *frame == 2'147'483'647) {
      return problem;
    }
    selection.begin = *frame;
    selection.end = *frame + 1;
    return "";
  }
  const std::string_view first = text.substr(0, colon);
  const std::string_view last = text.substr(colon + 1);
  const auto begin = number_of(first);
  const auto end = number_of(last);
  if ((!first.empty() && !begin) || (!last.empty() && !end) || (!begin && !end) ||
      (begin && end && *begin >= *end)) {
    return problem;
  }
  selection.begin = begin;
  selection.end = end;
  return "";
}

std::string set_shard(FrameSelection& selection, std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash != std::string_view::npos) {
    const auto shard = number_of(text.substr(0, slash));
    const auto shards = number_of(text.substr(slash + 1));
    if (shard && shards && *shard < *shards && *shards <= kMaxShards) {
      selection.shard = *shard;
      selection.shards = *shards;
      return "";
    }
  }
  return "--shard cannot be " + shown(text) + ": it takes i/n, 0 <= i < n <= 100000";
}

std::vector<int> selected_frames(const FrameSelection& selection,
                                 const std::vector<int>& frame_ids) {
  std::vector<int> selected;
  for (std::size_t i = 0; i < frame_ids.size(); ++i) {
    // By place in the whole list, so that shards of any range stay disjoint.
    if (static_cast<int>(i % static_cast<std::size_t>(selection.shards)) == selection.shard &&
        (!selection.begin || frame_ids[i] >= *selection.begin) &&
        (!selection.end || frame_ids[i] < *selection.end)) {
      selected.push_back(frame_ids[i]);
    }
  }
  return selected;
}

std::vector<int> some_selected_frames(const FrameSelection& selection,
                                      const std::vector<int>& frame_ids, const std::string& input) {
  FrameSelection range = selection;
  range.shard = 0;
  range.shards = 1;
  if (selected_frames(range, frame_ids).empty() && !frame_ids.empty()) {
    constexpr std::string_view kFlag = "--frames ";
    throw UnknownValue(
        input, "frames", to_string(range).substr(kFlag.size()),
        frame_ids.size() == 1
            ? "a range that holds frame " + std::to_string(frame_ids.front()) + ", the only one"
            : "a range that holds one of " + std::to_string(frame_ids.size()) + " frames, " +
                  std::to_string(frame_ids.front()) + " to " + std::to_string(frame_ids.back()));
  }
  return selected_frames(selection, frame_ids);
}

std::string to_string(const FrameSelection& selection) {
  if (selection.everything()) {
    return "every frame";
  }
  std::string text;
  if (selection.begin && selection.end && *selection.end == *selection.begin + 1) {
    text = "--frames " + std::to_string(*selection.begin);
  } else if (selection.begin || selection.end) {
    text = "--frames " + (selection.begin ? std::to_string(*selection.begin) : "") + ":" +
           (selection.end ? std::to_string(*selection.end) : "");
  }
  if (selection.shards > 1) {
    text += (text.empty() ? "--shard " : " --shard ") + std::to_string(selection.shard) + "/" +
            std::to_string(selection.shards);
  }
  return text;
}

}  // namespace atelier
