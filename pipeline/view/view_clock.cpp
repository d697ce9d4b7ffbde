#include "pipeline/view/view_clock.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kStill = 1;     // frames a second of what says none
constexpr double kSame = 1e-3;   // rates that differ by less are the same: 29.97 and 29.970030
constexpr double kRound = 1e-6;  // frames
constexpr double kMostTogether = 1e6;  // of sequences that begin together

/// Layers of one rate, whose frames are those of the same numbers.
struct RateGroup {
  double fps = 0;
  std::set<int> frame_ids;
  std::vector<ViewLayer*> layers;

  double seconds() const { return static_cast<double>(frame_ids.size()) / fps; }
  std::string name() const { return layers.size() == 1 ? layers.front()->name : ""; }
};

/// A layer of one frame is shown at any time, and one without a rate goes with the others.
bool has_rate(const ViewLayer& layer) {
  return layer.sequence.fps > 0 && layer.sequence.frame_ids.size() > 1;
}

std::vector<RateGroup> groups_of(std::vector<ViewLayer>& layers) {
  std::vector<RateGroup> groups;
  for (ViewLayer& layer : layers) {
    if (!has_rate(layer)) {
      continue;
    }
    const double fps = layer.sequence.fps;
    auto at = std::find_if(groups.begin(), groups.end(), [&](const RateGroup& one) {
      return std::abs(one.fps - fps) < kSame * fps;
    });
    if (at == groups.end()) {
      at = groups.insert(at, {fps, {}, {}});
    }
    at->frame_ids.insert(layer.sequence.frame_ids.begin(), layer.sequence.frame_ids.end());
    at->layers.push_back(&layer);
  }
  return groups;
}

/// The first of the layers that says a rate, though it may have one frame alone.
double told_rate(std::span<const ViewLayer> layers) {
  for (const ViewLayer& layer : layers) {
    if (layer.sequence.fps > 0) {
      return layer.sequence.fps;
    }
  }
  return kStill;
}

bool follow_each_other(std::span<const RateGroup> by_number) {
  return std::adjacent_find(by_number.begin(), by_number.end(),
                            [](const RateGroup& one, const RateGroup& next) {
                              return *one.frame_ids.rbegin() >= *next.frame_ids.begin();
                            }) == by_number.end();
}

/// The frame of `fps` that is shown when frame `index` of another rate is due.
std::size_t frame_at(std::size_t index, double rate, double fps) {
  return saturating_cast<std::size_t>(std::ceil(static_cast<double>(index) / rate * fps - kRound));
}

const RateGroup& fastest_of(std::span<const RateGroup> groups) {
  return *std::max_element(groups.begin(), groups.end(),
                           [](const auto& a, const auto& b) { return a.fps < b.fps; });
}

/// Frames of the fastest group for as long as the longest lasts.
double frames_together(std::span<const RateGroup> groups) {
  double seconds = 0;
  for (const RateGroup& group : groups) {
    seconds = std::max(seconds, group.seconds());
  }
  return std::ceil(seconds * fastest_of(groups).fps - kRound);
}

/// Groups that begin together, by the clock of the fastest.
void put_together(ViewTimeline& timeline, std::span<const RateGroup> groups) {
  const RateGroup& fastest = fastest_of(groups);
  std::vector<int>& ids = timeline.frame_ids;
  ids.assign(fastest.frame_ids.begin(), fastest.frame_ids.end());
  const auto count = saturating_cast<std::size_t>(frames_together(groups));
  while (ids.size() < count) {
    ids.push_back(ids.back() + 1);
  }
  timeline.takes = {{"", fastest.fps, 0}};
  const auto number = [&](std::size_t frame) {
    return frame < ids.size() ? ids[frame] : ids.back() + 1;
  };
  for (const RateGroup& group : groups) {
    if (&group == &fastest) {
      continue;
    }
    std::map<int, std::size_t> places;
    for (const int id : group.frame_ids) {
      places.emplace(id, places.size());
    }
    for (ViewLayer* layer : group.layers) {
      for (const int id : layer->sequence.frame_ids) {
        layer->begins.push_back(number(frame_at(places.at(id), group.fps, fastest.fps)));
      }
      const std::size_t last = places.at(layer->sequence.frame_ids.back());
      layer->begins.push_back(number(frame_at(last + 1, group.fps, fastest.fps)));
    }
  }
}

}  // namespace

void set_capture_frames(ViewTimeline& timeline, std::span<const CaptureSequence> sequences,
                        const std::vector<int>& frame_ids) {
  std::set<int> ids(frame_ids.begin(), frame_ids.end());
  for (const ViewLayer& layer : timeline.layers) {
    ids.insert(layer.sequence.frame_ids.begin(), layer.sequence.frame_ids.end());
  }
  timeline.frame_ids.assign(ids.begin(), ids.end());
  timeline.takes.clear();
  const CaptureSequence* now = nullptr;
  for (std::size_t i = 0; i < timeline.frame_ids.size(); ++i) {
    const int id = timeline.frame_ids[i];
    const auto at = std::find_if(sequences.begin(), sequences.end(), [id](const auto& one) {
      return std::binary_search(one.frame_ids.begin(), one.frame_ids.end(), id);
    });
    // A frame of no sequence is taken for one of those around it.
    if (at != sequences.end() && &*at != now) {
      now = &*at;
      timeline.takes.push_back({now->name, now->fps > 0 ? now->fps : kStill, i});
      timeline.takes.front().first = 0;
    }
  }
  if (timeline.takes.empty()) {
    timeline.takes = {{"", told_rate(timeline.layers), 0}};
  }
}

void set_layer_frames(ViewTimeline& timeline) {
  std::vector<RateGroup> groups = groups_of(timeline.layers);
  std::sort(groups.begin(), groups.end(), [](const RateGroup& a, const RateGroup& b) {
    return *a.frame_ids.begin() < *b.frame_ids.begin();
  });
  timeline.takes.clear();
  if (groups.size() > 1 && !follow_each_other(groups) && frames_together(groups) <= kMostTogether) {
    put_together(timeline, groups);
    return;
  }
  std::set<int> ids;
  for (const ViewLayer& layer : timeline.layers) {
    ids.insert(layer.sequence.frame_ids.begin(), layer.sequence.frame_ids.end());
  }
  timeline.frame_ids.assign(ids.begin(), ids.end());
  for (const RateGroup& group : groups) {
    const auto first = timeline.takes.empty()
                           ? timeline.frame_ids.begin()
                           : std::lower_bound(timeline.frame_ids.begin(), timeline.frame_ids.end(),
                                              *group.frame_ids.begin());
    timeline.takes.push_back({groups.size() > 1 ? group.name() : "", group.fps,
                              static_cast<std::size_t>(first - timeline.frame_ids.begin())});
  }
  if (timeline.takes.empty()) {
    timeline.takes = {{"", told_rate(timeline.layers), 0}};
  }
}

}  // namespace atelier
