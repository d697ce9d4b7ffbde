#include "capture/dataset.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace atelier {

Index camera_index(const Dataset& dataset, const std::string& id) {
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (dataset.cameras[c].id == id) {
      return static_cast<Index>(c);
    }
  }
  return -1;
}

std::vector<int> frame_ids(const Dataset& dataset) {
  std::vector<int> ids;
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    ids.insert(ids.end(), sequence.frame_ids.begin(), sequence.frame_ids.end());
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

void add_frames(std::vector<int>& frames, const std::vector<int>& more) {
  if (std::includes(frames.begin(), frames.end(), more.begin(), more.end())) {
    return;
  }
  std::vector<int> all;
  all.reserve(std::max(frames.size(), more.size()));
  std::set_union(frames.begin(), frames.end(), more.begin(), more.end(), std::back_inserter(all));
  frames = std::move(all);
}

}  // namespace atelier
