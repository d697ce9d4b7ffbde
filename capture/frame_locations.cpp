#include "capture/frame_locations.h"

#include <algorithm>
#include <string_view>

#include "capture/frame_number.h"
#include "core/error.h"

namespace atelier {
namespace {

std::string digits_of(std::int64_t number, std::size_t digits) {
  std::string text = std::to_string(number);
  return text.size() < digits ? std::string(digits - text.size(), '0') + text : text;
}

/// The number that `text` has where `rest` lacks it.
std::optional<std::int64_t> number_between(std::string_view text, std::string_view rest,
                                           std::size_t at, std::size_t digits) {
  if (text.size() < rest.size() + digits || !text.starts_with(rest.substr(0, at)) ||
      !text.ends_with(rest.substr(at))) {
    return std::nullopt;
  }
  const std::string_view middle = text.substr(at, text.size() - rest.size());
  const bool number =
      std::all_of(middle.begin(), middle.end(), [](char c) { return c >= '0' && c <= '9'; });
  const std::optional<std::int64_t> value = number ? long_number(middle) : std::nullopt;
  return value && digits_of(*value, digits) == middle ? value : std::nullopt;
}

}  // namespace

FrameLocations::const_iterator& FrameLocations::const_iterator::operator++() {
  if (++at_ == places_->runs_[run_].count) {
    ++run_;
    at_ = 0;
  }
  load();
  return *this;
}

void FrameLocations::const_iterator::load() {
  if (run_ < places_->runs_.size()) {
    const Run& run = places_->runs_[run_];
    value_ = {run.frame + at_, place_of(places_->patterns_[run.pattern], run.number + at_)};
  }
}

FrameLocations::Pattern FrameLocations::pattern_of(int frame, const DataLocation& place) {
  Pattern pattern{Numbered::Nothing, place.file.native(), place.member};
  if (place.index >= 0) {
    pattern.numbered = Numbered::Index;
    return pattern;
  }
  const bool is_member = !place.member.empty();
  std::string& text = is_member ? pattern.member : pattern.file;
  const std::size_t slash = text.rfind('/');
  const std::size_t name = slash == std::string::npos ? 0 : slash + 1;
  // The run of digits that is the frame's, else the last: of "000012_cam04.png" the first.
  std::optional<std::string_view> chosen;
  bool of_frame = false;
  for (std::size_t begin = name; begin < text.size();) {
    std::size_t end = begin;
    while (end < text.size() && text[end] >= '0' && text[end] <= '9') {
      ++end;
    }
    const std::string_view digits = std::string_view(text).substr(begin, end - begin);
    const std::int64_t value = long_number(digits).value_or(-1);  // -1: none, or too long
    if (value == frame || (value >= 0 && !of_frame)) {
      chosen = digits;
      of_frame = value == frame;
    }
    begin = std::max(end, begin + 1);
  }
  if (chosen) {
    pattern.numbered = is_member ? Numbered::Member : Numbered::File;
    pattern.at = static_cast<std::size_t>(chosen->data() - text.data());
    // Leading zeros tell how many digits there are at least, other numbers nothing.
    pattern.digits = chosen->size() > 1 && chosen->front() == '0' ? chosen->size() : 1;
    const std::size_t size = chosen->size();
    text.erase(pattern.at, size);
  }
  return pattern;
}

std::optional<std::int64_t> FrameLocations::number_in(const Pattern& pattern,
                                                      const DataLocation& place) {
  const std::string& file = place.file.native();
  switch (pattern.numbered) {
    case Numbered::Index:
      return place.index >= 0 && file == pattern.file && place.member == pattern.member
                 ? std::optional<std::int64_t>(place.index)
                 : std::nullopt;
    case Numbered::File:
      return place.index < 0 && place.member == pattern.member
                 ? number_between(file, pattern.file, pattern.at, pattern.digits)
                 : std::nullopt;
    case Numbered::Member:
      return place.index < 0 && file == pattern.file
                 ? number_between(place.member, pattern.member, pattern.at, pattern.digits)
                 : std::nullopt;
    case Numbered::Nothing:
      break;
  }
  return std::nullopt;
}

DataLocation FrameLocations::place_of(const Pattern& pattern, std::int64_t number) {
  const auto numbered = [&](std::string text) {
    return text.insert(pattern.at, digits_of(number, pattern.digits));
  };
  switch (pattern.numbered) {
    case Numbered::Index:
      return {pattern.file, pattern.member, static_cast<int>(number)};
    case Numbered::File:
      return {numbered(pattern.file), pattern.member, -1};
    case Numbered::Member:
      return {pattern.file, numbered(pattern.member), -1};
    case Numbered::Nothing:
      break;
  }
  return {pattern.file, pattern.member, -1};
}

std::size_t FrameLocations::run_of(int frame) const {
  const auto after =
      std::upper_bound(runs_.begin(), runs_.end(), frame,
                       [](int wanted, const Run& run) { return wanted < run.frame; });
  if (after == runs_.begin() || frame - std::prev(after)->frame >= std::prev(after)->count) {
    return runs_.size();
  }
  return static_cast<std::size_t>(after - runs_.begin()) - 1;
}

bool FrameLocations::add(int frame, const DataLocation& place) {
  if (contains(frame)) {
    return false;
  }
  // Of the patterns the latest alone: a folder has few, or as many as files.
  constexpr std::size_t kLooked = 32;
  std::optional<std::int64_t> number;
  std::size_t pattern = patterns_.size();
  while (!number && pattern > 0 && patterns_.size() - pattern < kLooked) {
    number = number_in(patterns_[--pattern], place);
  }
  if (!number) {
    pattern = patterns_.size();
    patterns_.push_back(pattern_of(frame, place));
    number = number_in(patterns_.back(), place).value_or(0);
  }
  const Run run{*number, frame, 1, static_cast<std::uint32_t>(pattern)};
  const auto after =
      std::upper_bound(runs_.begin(), runs_.end(), frame,
                       [](int wanted, const Run& other) { return wanted < other.frame; });
  const auto before = after == runs_.begin() ? runs_.end() : std::prev(after);
  ++size_;
  if (before != runs_.end() && joins(*before, run)) {
    ++before->count;
    if (after != runs_.end() && joins(*before, *after)) {
      before->count += after->count;
      runs_.erase(after);
    }
  } else if (after != runs_.end() && joins(run, *after)) {
    *after = {run.number, run.frame, after->count + 1, run.pattern};
  } else {
    runs_.insert(after, run);
  }
  return true;
}

void FrameLocations::set(int frame, const DataLocation& place) {
  erase(frame);
  add(frame, place);
}

void FrameLocations::merge(const FrameLocations& others) {
  for (const auto& [frame, place] : others) {
    add(frame, place);
  }
}

bool FrameLocations::erase(int frame) {
  const std::size_t at = run_of(frame);
  if (at == runs_.size()) {
    return false;
  }
  --size_;
  Run& run = runs_[at];
  const int before = frame - run.frame;
  const Run rest{run.number + before + 1, frame + 1, run.count - before - 1, run.pattern};
  run.count = before;
  const auto place = runs_.begin() + static_cast<std::ptrdiff_t>(at);
  if (rest.count > 0 && before > 0) {
    runs_.insert(std::next(place), rest);
  } else if (rest.count > 0) {
    run = rest;
  } else if (before == 0) {
    runs_.erase(place);
  }
  return true;
}

std::optional<DataLocation> FrameLocations::find(int frame) const {
  const std::size_t at = run_of(frame);
  if (at == runs_.size()) {
    return std::nullopt;
  }
  const Run& run = runs_[at];
  return place_of(patterns_[run.pattern], run.number + (frame - run.frame));
}

std::vector<int> FrameLocations::frames() const {
  std::vector<int> ids;
  ids.reserve(size_);
  for (const Run& run : runs_) {
    for (int i = 0; i < run.count; ++i) {
      ids.push_back(run.frame + i);
    }
  }
  return ids;
}

FrameLocations FrameLocations::shifted(int by) const {
  FrameLocations moved = *this;
  moved.runs_.clear();
  moved.size_ = 0;
  for (Run run : runs_) {
    const int gone = std::clamp(-(run.frame + by), 0, run.count);
    run.frame += by + gone;
    run.number += gone;
    run.count -= gone;
    if (run.count > 0) {
      moved.runs_.push_back(run);
      moved.size_ += static_cast<std::size_t>(run.count);
    }
  }
  return moved;
}

FrameLocations FrameLocations::only(const std::vector<int>& frames) const {
  FrameLocations kept;
  kept.patterns_ = patterns_;
  for (const int frame : frames) {
    const std::size_t at = run_of(frame);
    if (at == runs_.size()) {
      continue;
    }
    const Run& of = runs_[at];
    const Run run{of.number + (frame - of.frame), frame, 1, of.pattern};
    ++kept.size_;
    if (!kept.runs_.empty() && joins(kept.runs_.back(), run)) {
      ++kept.runs_.back().count;
    } else {
      kept.runs_.push_back(run);
    }
  }
  return kept;
}

std::size_t FrameLocations::bytes() const {
  std::size_t sum = runs_.capacity() * sizeof(Run) + patterns_.capacity() * sizeof(Pattern);
  for (const Pattern& pattern : patterns_) {
    sum += pattern.file.capacity() + pattern.member.capacity();
  }
  return sum;
}

}  // namespace atelier
