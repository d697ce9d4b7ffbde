#include "bodymodel/formats/motion_c3d.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "bodymodel/formats/c3d_parameters.h"
#include "bodymodel/formats/marker_subjects.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/polygon_mesh.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr std::uint64_t kPadding = 512;  // bytes: data may be filled up to a whole block
constexpr std::int64_t kWrap = 65'536;   // frames at which the header begins anew
constexpr std::int64_t kLastOfHeader = 65'535;

// Points that are numbers in three columns and no places: Vicon's and Visual3D's models write them.
std::set<std::string> modelled_outputs(const C3dFile& file) {
  std::set<std::string> names;
  for (const char* group : {"POINT:ANGLES", "POINT:FORCES", "POINT:MOMENTS", "POINT:POWERS",
                            "POINT:SCALARS", "POINT:REACTIONS"}) {
    const std::vector<std::string> some = file.texts(group);
    names.insert(some.begin(), some.end());
  }
  return names;
}

// "RKNE", "RKNE_2": of names that are there twice the first counts, as they were recorded before
// models and programs added theirs.
void number_repeated_names(MarkerClip& clip) {
  std::set<std::string> once;
  std::string repeated;
  for (std::string& marker : clip.markers) {
    if (once.insert(marker).second) {
      continue;
    }
    int number = 2;
    while (!once.insert(marker + "_" + std::to_string(number)).second) {
      ++number;
    }
    if (number == 2 && repeated.size() < 80) {
      repeated += (repeated.empty() ? "" : ", ") + marker.substr(0, 40);
    }
    marker += "_" + std::to_string(number);
  }
  if (!repeated.empty()) {
    clip.findings.push_back({Severity::Warning, "motion-markers-names", clip.name,
                             "names of points that are there twice: " + repeated,
                             "the first of each name counts, later ones have a number"});
  }
}

// The named points that are places, by their column in the file.
std::vector<std::size_t> named_points(const C3dFile& file, const Limits& limits, MarkerClip& clip) {
  std::vector<std::string> names = file.texts("POINT:LABELS");
  names.resize(std::min(names.size(), static_cast<std::size_t>(file.header().points)));
  const std::set<std::string> outputs = modelled_outputs(file);
  std::vector<std::size_t> kept;
  std::size_t left_out = 0;
  for (std::size_t m = 0; m < names.size(); ++m) {
    const std::string& name = names[m];
    if (name.empty() || name[0] == '*') {
      continue;
    }
    if (outputs.contains(name) || outputs.contains(name.substr(name.rfind(':') + 1))) {
      ++left_out;
      continue;
    }
    kept.push_back(m);
    clip.markers.push_back(name);
  }
  if (left_out > 0) {
    clip.findings.push_back(
        {Severity::Note, "motion-markers-outputs", clip.name,
         std::to_string(left_out) + " points are angles, forces, moments or powers of a model",
         "they are no markers and were left out"});
  }
  if (kept.empty() || std::cmp_greater(kept.size(), limits.joints)) {
    throw DataError(clip.name, "POINT:LABELS", std::to_string(kept.size()) + " names of points",
                    "1 to " + std::to_string(limits.joints));
  }
  number_repeated_names(clip);
  return kept;
}

// A number of frames from two words, the low one first, or from one number; 0 where there is none.
std::int64_t long_count(const std::vector<double>& numbers) {
  const double count = numbers.empty()       ? 0
                       : numbers.size() == 1 ? numbers[0]
                                             : numbers[0] + static_cast<double>(kWrap) * numbers[1];
  return count >= 1 && count < 2e9 ? static_cast<std::int64_t>(count) : 0;
}

struct C3dFrames {
  std::int64_t first = 0;
  std::int64_t count = 0;
};

// Counts of frames that header and parameters say; 0 where one says nothing. `most`: what the file
// has bytes for.
std::vector<std::int64_t> said_counts(const C3dFile& file, std::int64_t most) {
  const C3dHeader& header = file.header();
  const std::int64_t first = long_count(file.numbers("TRIAL:ACTUAL_START_FIELD"));
  const std::int64_t last = long_count(file.numbers("TRIAL:ACTUAL_END_FIELD"));
  const std::int64_t said = std::int64_t{header.last} - header.first + 1;
  const std::int64_t wraps = said < 1 ? 0 : (most - said) / kWrap;
  return {last > 0 ? last - std::max<std::int64_t>(first, 1) + 1 : 0,
          long_count(file.numbers("POINT:LONG_FRAMES")),
          file.type("POINT:FRAMES") == 4 ? long_count(file.numbers("POINT:FRAMES")) : 0,
          said,
          file.type("POINT:FRAMES") == 2 ? long_count(file.numbers("POINT:FRAMES")) : 0,
          said + kWrap * wraps,
          header.last == kLastOfHeader ? most : 0};
}

// The count that fills the file but for less than a block, 0 where none does.
std::int64_t filling_count(const C3dFile& file, std::uint64_t held, std::size_t row) {
  const auto most = static_cast<std::int64_t>(held / row);
  for (const std::int64_t count : said_counts(file, most)) {
    if (count >= 1 && count <= most &&
        held - static_cast<std::uint64_t>(count) * row < std::max<std::uint64_t>(kPadding, row)) {
      return count;
    }
  }
  return 0;
}

// How many frames there are, of those that parameters and header say and the file has bytes for.
C3dFrames frames_of_file(const C3dFile& file, std::uint64_t held, std::size_t row,
                         const Limits& limits, MarkerClip& clip) {
  const C3dHeader& header = file.header();
  const auto most = static_cast<std::int64_t>(held / row);
  const std::int64_t said = std::int64_t{header.last} - header.first + 1;
  const std::int64_t first = long_count(file.numbers("TRIAL:ACTUAL_START_FIELD"));
  const std::int64_t filling = filling_count(file, held, row);
  C3dFrames frames{first > 0 && file.number("TRIAL:ACTUAL_END_FIELD") ? first : header.first,
                   filling};
  for (const std::int64_t count : said_counts(file, most)) {
    if (frames.count == 0 && count >= 1 && count <= most) {
      frames.count = count;
    }
  }
  if (frames.count < 1 || frames.count > limits.frames) {
    throw DataError(clip.name, "header",
                    std::to_string(said) + " frames, and bytes for " + std::to_string(most) +
                        (frames.count < 1 ? " (the file is cut off)" : ""),
                    "1 to " + std::to_string(limits.frames) + ", and the frames behind the header");
  }
  if (frames.count != said || filling == 0) {
    clip.findings.push_back({filling == 0 ? Severity::Warning : Severity::Note, "motion-frames",
                             clip.name,
                             "the header says " + std::to_string(said) +
                                 " frames, the file has bytes for " + std::to_string(most),
                             std::to_string(frames.count) + " are read"});
  }
  return frames;
}

// How coordinates are stored.
struct C3dLayout {
  bool real_numbers = false;
  std::size_t width = 0;  // bytes of a number
  std::size_t row = 0;    // bytes of a frame
  double scale = 0;       // metres
};

// POINT:SCALE stands in for a header without one.
C3dLayout layout_of(const C3dFile& file, std::uint64_t held, const MarkerClip& clip) {
  const C3dHeader& header = file.header();
  const double scale = header.scale != 0 && std::isfinite(header.scale)
                           ? header.scale
                           : file.number("POINT:SCALE").value_or(0);
  if (scale == 0 || !std::isfinite(scale)) {
    throw DataError(clip.name, "header", "a scale of " + short_number(scale),
                    "the size of one unit of the coordinates, or below 0 for real numbers");
  }
  C3dLayout layout;
  layout.real_numbers = scale < 0;
  layout.width = layout.real_numbers ? 4 : 2;
  const auto row = [&](std::size_t analog) {
    return layout.width * (4 * static_cast<std::size_t>(header.points) + analog);
  };
  const auto analog = static_cast<std::size_t>(header.analog);
  layout.row = row(analog);
  // Some programs count channels there, and not the numbers of a frame.
  const std::size_t all = analog * static_cast<std::size_t>(std::max(1, header.analog_samples));
  if (filling_count(file, held, layout.row) == 0 && filling_count(file, held, row(all)) > 0) {
    layout.row = row(all);
  }
  layout.scale = clip.metres_per_unit * (layout.real_numbers ? 1 : scale);
  return layout;
}

// Programs read one or the other.
void compare_rates_of(const C3dFile& file, MarkerClip& clip) {
  constexpr double kOff = 0.01;
  const double header = file.header().fps;
  if (header > 0 && std::isfinite(header) && std::abs(header / clip.fps - 1) > kOff) {
    clip.findings.push_back({Severity::Warning, "motion-rate", clip.name,
                             "the header says " + short_number(header) +
                                 " frames a second, POINT:RATE says " + short_number(clip.fps),
                             "POINT:RATE is taken; --motion.fps sets another"});
  }
}

// Places may be there all the same, which nothing but the residuals says to be invalid.
void note_nothing_seen(MarkerClip& clip) {
  const bool any = std::any_of(clip.seen.begin(), clip.seen.end(), [](const auto& seen) {
    return std::find(seen.begin(), seen.end(), true) != seen.end();
  });
  if (!any) {
    clip.findings.push_back(
        {Severity::Warning, "motion-markers-unseen", clip.name,
         "no point is seen in any frame: all have a residual below 0, or are no numbers",
         "write the points as valid with the program that made them"});
  }
}

void read_frames(C3dNumbers& numbers, const C3dLayout& layout, const C3dFrames& frames,
                 const std::vector<std::size_t>& kept, const Limits& limits, MarkerClip& clip) {
  ByteReader& in = numbers.reader();
  for (std::int64_t frame = 0; frame < frames.count; ++frame) {
    Points positions = Points::Zero(static_cast<Index>(kept.size()), 3);
    std::vector<bool> seen(kept.size(), false);
    const std::size_t at = in.position();
    for (std::size_t m = 0; m < kept.size(); ++m) {
      in.seek(at + kept[m] * 4 * layout.width, "a point");
      Eigen::Vector4d values;
      for (double& value : values) {
        value = layout.real_numbers
                    ? numbers.real("a coordinate")
                    : static_cast<double>(numbers.next<std::int16_t>("a coordinate"));
      }
      if (values[3] < 0 || !values.head<3>().allFinite()) {
        continue;
      }
      const Eigen::Vector3d metres = layout.scale * values.head<3>();
      if (!(metres.cwiseAbs().maxCoeff() < limits.mesh_coordinate)) {
        in.fail("a coordinate of " + short_number(values.head<3>().cwiseAbs().maxCoeff()),
                "a finite number");
      }
      positions.row(static_cast<Index>(m)) = metres;
      seen[m] = true;
    }
    in.seek(at + layout.row, "the next frame");
    clip.frame_ids.push_back(static_cast<int>(frames.first + frame));
    clip.positions.push_back(std::move(positions));
    clip.seen.push_back(std::move(seen));
  }
  note_nothing_seen(clip);
}

// Theia3D and Visual3D write segments as 4 x 4 matrices, column by column, and a residual.
constexpr std::size_t kRotationNumbers = 17;
constexpr double kAhead = 0.1;  // m, of the second point of a segment; our choice

// Two points of each segment: its origin, which is a joint's centre, under the segment's name, and
// one ahead of it along its second axis, "NAME.y", which says how the segment is turned.
struct C3dSegments {
  std::vector<std::size_t> columns;
  int ratio = 1;  // matrices of a segment in a frame
};

C3dSegments named_segments(const C3dFile& file, std::size_t used, const Limits& limits,
                           MarkerClip& clip) {
  const std::vector<std::string> names = file.texts("ROTATION:LABELS");
  C3dSegments segments;
  for (std::size_t i = 0; i < std::min(names.size(), used); ++i) {
    if (!names[i].empty() && !names[i].starts_with("worldbody")) {
      segments.columns.push_back(i);
      clip.markers.push_back(names[i]);
      clip.markers.push_back(names[i] + ".y");
    }
  }
  if (segments.columns.empty() || std::cmp_greater(clip.markers.size(), limits.joints)) {
    throw DataError(clip.name, "ROTATION:LABELS",
                    std::to_string(segments.columns.size()) + " names of segments",
                    "1 to " + std::to_string(limits.joints / 2));
  }
  const double rate = file.number("ROTATION:RATE").value_or(clip.fps);
  const double ratio = std::round(file.number("ROTATION:RATIO").value_or(rate / clip.fps));
  constexpr double kMost = 1000;
  if (!(ratio >= 1 && ratio <= kMost)) {
    throw DataError(clip.name, "ROTATION:RATIO", short_number(ratio), "1 to 1000");
  }
  segments.ratio = saturating_cast<int>(ratio);
  number_repeated_names(clip);
  return segments;
}

void read_segments(const C3dFile& file, std::span<const std::byte> bytes, const Limits& limits,
                   MarkerClip& clip) {
  if (!(file.header().scale < 0)) {
    throw DataError(clip.name, "header", "rotations of segments as whole numbers", "real numbers");
  }
  constexpr double kMost = 65'535;  // of 16 bits
  const double segments_used = file.number("ROTATION:USED").value_or(0);
  if (!(segments_used >= 1 && segments_used <= kMost)) {
    throw DataError(clip.name, "ROTATION:USED", short_number(segments_used), "1 to 65535");
  }
  const auto used = saturating_cast<std::size_t>(segments_used);
  const C3dSegments segments = named_segments(file, used, limits, clip);
  const double block = file.number("ROTATION:DATA_START").value_or(0);
  if (!(block >= 1 && block <= kMost)) {
    throw DataError(clip.name, "ROTATION:DATA_START", short_number(block), "a block of the file");
  }
  C3dNumbers numbers(bytes, clip.name, file.processor());
  ByteReader& in = numbers.reader();
  in.seek(512 * (saturating_cast<std::uint64_t>(block) - 1), "the rotations");
  const auto ratio = static_cast<std::size_t>(segments.ratio);
  const std::size_t row = 4 * kRotationNumbers * used;
  const C3dFrames frames = frames_of_file(file, in.remaining(), row * ratio, limits, clip);
  const std::int64_t count = frames.count * segments.ratio;
  if (count > limits.frames) {
    throw DataError(clip.name, "ROTATION:RATIO", std::to_string(count) + " matrices of a segment",
                    "at most " + std::to_string(limits.frames));
  }
  clip.fps *= segments.ratio;
  const std::int64_t first = (frames.first - 1) * segments.ratio + 1;
  constexpr std::int64_t kLastNumber = 2'000'000'000;
  for (std::int64_t frame = 0; frame < count; ++frame) {
    Points positions = Points::Zero(static_cast<Index>(clip.markers.size()), 3);
    std::vector<bool> seen(clip.markers.size(), false);
    const std::size_t at = in.position();
    for (std::size_t s = 0; s < segments.columns.size(); ++s) {
      in.seek(at + 4 * kRotationNumbers * segments.columns[s], "a segment");
      Eigen::Matrix<double, kRotationNumbers, 1> values;
      for (double& value : values) {
        value = numbers.real("a matrix");
      }
      if (!values.allFinite() || values[16] < 0) {
        continue;
      }
      const Eigen::Vector3d origin = clip.metres_per_unit * values.segment<3>(12);
      if (!(origin.cwiseAbs().maxCoeff() < limits.mesh_coordinate &&
            values.segment<3>(4).norm() < 2)) {
        in.fail("a matrix that is none of a segment", "a rotation and a place");
      }
      positions.row(static_cast<Index>(2 * s)) = origin;
      positions.row(static_cast<Index>(2 * s + 1)) = origin + kAhead * values.segment<3>(4);
      seen[2 * s] = true;
      seen[2 * s + 1] = true;
    }
    in.seek(at + row, "the next frame");
    clip.frame_ids.push_back(static_cast<int>((first + count < kLastNumber ? first : 1) + frame));
    clip.positions.push_back(std::move(positions));
    clip.seen.push_back(std::move(seen));
  }
}

}  // namespace

MarkerClip read_c3d(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits) {
  const C3dFile file(bytes, name);
  MarkerClip clip;
  clip.name = name;
  clip.findings = file.findings();
  clip.fps = file.number("POINT:RATE").value_or(file.header().fps);
  if (!(clip.fps > 0) || !std::isfinite(clip.fps)) {
    throw DataError(name, "POINT:RATE", short_number(clip.fps), "more than 0");
  }
  compare_rates_of(file, clip);
  const std::vector<std::string> units = file.texts("POINT:UNITS");
  const std::string unit = units.empty() || units[0].empty() ? "mm" : units[0];
  clip.metres_per_unit = metres_of_unit(unit);
  if (clip.metres_per_unit == 0) {
    throw DataError(name, "POINT:UNITS", "'" + unit.substr(0, 20) + "'", "m, cm, mm or in");
  }
  const bool rotations = file.number("ROTATION:USED").value_or(0) > 0;
  if (rotations && file.header().points == 0) {
    read_segments(file, bytes, limits, clip);
    return clip;
  }
  if (rotations) {
    clip.findings.push_back({Severity::Note, "motion-segments", name,
                             "rotations of segments stand beside the points",
                             "the points are read, and the rotations passed over"});
  }
  const std::vector<std::size_t> kept = named_points(file, limits, clip);
  C3dNumbers numbers(bytes, name, file.processor());
  numbers.reader().seek(file.header().data, "the data");
  const std::uint64_t held = numbers.reader().remaining();
  const C3dLayout layout = layout_of(file, held, clip);
  const C3dFrames frames = frames_of_file(file, held, layout.row, limits, clip);
  read_frames(numbers, layout, frames, kept, limits, clip);
  name_subjects(clip);
  lose_markers_at_origin(clip);
  return clip;
}

MarkerClip read_c3d(const std::filesystem::path& path, const Limits& limits) {
  MarkerClip clip =
      read_c3d(read_file_bytes(path, limits.motion_file_bytes), path.string(), limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
