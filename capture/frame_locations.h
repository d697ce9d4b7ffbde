#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace atelier {

/// Location of one image, mask, label image or detection.
struct DataLocation {
  std::filesystem::path file;  ///< a file of its own, a zip, a video, an HDF5 file
  std::string member;          ///< name inside a zip or an HDF5 file; "": the file itself
  int index = -1;              ///< frame of a video or row of an array, from 0; -1: neither

  bool operator==(const DataLocation&) const = default;
};

/// Places of one kind of a camera's data by frame id. A capture has millions of them, and their
/// names differ in a number alone: frames whose numbers follow each other are kept as one run of
/// 24 bytes, and what their names have in common once. A place is put together where it is asked
/// for.
class FrameLocations {
 public:
  using value_type = std::pair<int, DataLocation>;

  /// Gives frames by increasing id, each with its place.
  class const_iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = FrameLocations::value_type;
    using difference_type = std::ptrdiff_t;
    using pointer = const value_type*;
    using reference = const value_type&;

    const_iterator(const FrameLocations& places, std::size_t run) : places_(&places), run_(run) {
      load();
    }
    reference operator*() const { return value_; }
    pointer operator->() const { return &value_; }
    const_iterator& operator++();
    bool operator==(const const_iterator& other) const {
      return run_ == other.run_ && at_ == other.at_;
    }

   private:
    void load();

    const FrameLocations* places_;
    std::size_t run_;
    int at_ = 0;  ///< in the run
    value_type value_;
  };

  /// False, and nothing changes, if the frame has a place. Frames in increasing order cost least.
  bool add(int frame, const DataLocation& place);
  /// The same, in place of what the frame has.
  void set(int frame, const DataLocation& place);
  /// Adds the frames that are not there.
  void merge(const FrameLocations& others);
  bool erase(int frame);
  void clear() { *this = {}; }

  std::optional<DataLocation> find(int frame) const;
  bool contains(int frame) const { return run_of(frame) < runs_.size(); }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  /// 0 of none.
  int last_frame() const { return runs_.empty() ? 0 : runs_.back().frame + runs_.back().count - 1; }
  /// Frame ids, increasing.
  std::vector<int> frames() const;
  /// The same places under ids that are `by` higher; those that would be negative are left out.
  FrameLocations shifted(int by) const;
  /// Those of the given frames.
  /// @param frames  increasing
  FrameLocations only(const std::vector<int>& frames) const;
  const_iterator begin() const { return {*this, 0}; }
  const_iterator end() const { return {*this, runs_.size()}; }
  /// Bytes of memory beside the object itself.
  std::size_t bytes() const;

 private:
  /// Which part of a place has the number.
  enum class Numbered { Nothing, File, Member, Index };

  /// What places of a run have in common.
  struct Pattern {
    Numbered numbered = Numbered::Nothing;
    std::string file;  ///< without the number's digits, if it is numbered
    std::string member;
    std::size_t at = 0;      ///< where in it the digits are
    std::size_t digits = 0;  ///< at least, with leading zeros
  };

  /// Frames `frame`, `frame` + 1, ... whose numbers are `number`, `number` + 1, ...
  struct Run {
    std::int64_t number = 0;
    int frame = 0;
    int count = 0;
    std::uint32_t pattern = 0;
  };

  static Pattern pattern_of(int frame, const DataLocation& place);
  static std::optional<std::int64_t> number_in(const Pattern& pattern, const DataLocation& place);
  static DataLocation place_of(const Pattern& pattern, std::int64_t number);
  /// The run that has the frame; size of `runs_`: none.
  std::size_t run_of(int frame) const;
  static bool joins(const Run& before, const Run& after) {
    return before.pattern == after.pattern && after.frame - before.frame == before.count &&
           after.number - before.number == before.count;
  }

  std::vector<Pattern> patterns_;
  std::vector<Run> runs_;  ///< by frame
  std::size_t size_ = 0;
};

}  // namespace atelier
