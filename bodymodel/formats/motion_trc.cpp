#include "bodymodel/formats/motion_trc.h"

#include <cmath>
#include <set>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/polygon_mesh.h"
#include "core/io/text_scanner.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

using Cells = std::vector<std::string_view>;

std::string_view trimmed_cell(std::string_view cell) {
  while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\r')) {
    cell.remove_prefix(1);
  }
  while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\r')) {
    cell.remove_suffix(1);
  }
  return cell;
}

Cells cells_of(std::string_view line) {
  Cells cells;
  for (;;) {
    const std::size_t tab = line.find('\t');
    cells.push_back(trimmed_cell(line.substr(0, tab)));
    if (tab == std::string_view::npos) {
      return cells;
    }
    line.remove_prefix(tab + 1);
  }
}

// Lines of a text with their numbers, and errors that name them. (Empty cells count here, which is
// why TextScanner's words do not serve.)
class Lines {
 public:
  Lines(std::span<const std::byte> bytes, const std::string& name, const Limits& limits)
      : text_(as_text(bytes)), name_(name), limits_(limits) {}

  bool next(std::string_view& line) {
    if (at_ >= text_.size()) {
      return false;
    }
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    if (static_cast<std::int64_t>(line.size()) > limits_.line_bytes) {
      fail("a line of " + std::to_string(line.size()) + " bytes",
           "at most " + std::to_string(limits_.line_bytes));
    }
    if (line.find('\0') != std::string_view::npos) {
      fail("a NUL byte", "text");
    }
    return true;
  }

  Cells row(const char* what) {
    std::string_view line;
    if (!next(line)) {
      fail("the end of the file", what);
    }
    return cells_of(line);
  }

  double number(std::string_view cell, const char* what) const {
    double value = 0;
    if (!parse_number(cell, value)) {
      fail(in_quotes(cell), std::string("a finite number for ") + what);
    }
    return value;
  }

  /// A count; what a file writes as 10.0 is one too. The range comes before the cast, which has no
  /// meaning beyond it.
  std::int64_t count(std::string_view cell, const char* what, std::int64_t most) const {
    const double value = number(cell, what);
    if (!(value >= 1 && value <= static_cast<double>(most)) || value != std::floor(value)) {
      fail(in_quotes(cell),
           std::string("a whole number for ") + what + ", 1 to " + std::to_string(most));
    }
    return saturating_cast<std::int64_t>(value);
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(name_, "line " + std::to_string(number_), found, expected);
  }

  std::size_t left() const { return text_.size() - std::min(at_, text_.size()); }

 private:
  std::string_view text_;
  const std::string& name_;
  const Limits& limits_;
  std::size_t at_ = 0;
  std::int64_t number_ = 0;
};

struct TrcHeader {
  double fps = 0;
  std::int64_t frames = 0;
  std::int64_t markers = 0;
  double metres_per_unit = 0;
};

TrcHeader read_trc_header(Lines& lines, const Limits& limits) {
  if (lines.row("PathFileType").front() != "PathFileType") {
    lines.fail("no PathFileType", "a TRC file");
  }
  const Cells keys = lines.row("DataRate, ...");
  const Cells values = lines.row("the header's values");
  TrcHeader header;
  for (std::size_t i = 0; i < keys.size() && i < values.size(); ++i) {
    if (keys[i] == "DataRate") {
      header.fps = lines.number(values[i], "DataRate");
    } else if (keys[i] == "NumFrames") {
      header.frames = lines.count(values[i], "NumFrames", limits.frames);
    } else if (keys[i] == "NumMarkers") {
      header.markers = lines.count(values[i], "NumMarkers", limits.joints);
    } else if (keys[i] == "Units") {
      header.metres_per_unit = metres_of_unit(std::string(values[i]));
      if (header.metres_per_unit == 0) {
        lines.fail("unit " + in_quotes(values[i]), "m, cm, mm or in");
      }
    }
  }
  if (!(header.fps > 0)) {
    lines.fail("DataRate " + std::to_string(header.fps), "more than 0");
  }
  if (header.frames == 0 || header.markers == 0) {
    lines.fail(header.frames == 0 ? "no NumFrames" : "no NumMarkers", "counts of both");
  }
  if (header.metres_per_unit == 0) {
    lines.fail("no Units", "m, cm, mm or in");
  }
  return header;
}

}  // namespace

MarkerClip read_trc(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits) {
  Lines lines(bytes, name, limits);
  const TrcHeader header = read_trc_header(lines, limits);
  MarkerClip clip;
  clip.name = name;
  clip.fps = header.fps;
  clip.metres_per_unit = header.metres_per_unit;
  const Cells names = lines.row("the names of the markers");
  std::set<std::string_view> seen_names;
  for (std::size_t i = 2; i < names.size(); i += 3) {
    if (names[i].empty()) {
      break;
    }
    if (!seen_names.insert(names[i]).second) {
      lines.fail("marker " + in_quotes(names[i]) + " twice", "each name once");
    }
    clip.markers.emplace_back(names[i]);
  }
  const std::size_t count = clip.markers.size();
  if (static_cast<std::int64_t>(count) != header.markers) {
    lines.fail(std::to_string(count) + " names",
               std::to_string(header.markers) + ", as NumMarkers says");
  }
  lines.row("X1, Y1, Z1, ...");
  // Every frame takes a tab for each coordinate and a line end.
  if (static_cast<std::uint64_t>(header.frames) * (3 * count + 2) > lines.left() + 2) {
    lines.fail(std::to_string(lines.left()) + " bytes of motion",
               std::to_string(header.frames) + " frames (the file is cut off)");
  }
  std::string_view line;
  while (lines.next(line)) {
    if (trimmed_cell(line).empty()) {
      continue;
    }
    Cells cells = cells_of(line);
    while (cells.size() > 2 + 3 * count && cells.back().empty()) {
      cells.pop_back();  // writers end their rows with a tab
    }
    if (cells.size() != 2 + 3 * count) {
      lines.fail(std::to_string(cells.size()) + " cells",
                 std::to_string(2 + 3 * count) + ": frame, time and three for each marker");
    }
    const double frame = lines.number(cells[0], "the frame");
    if (!(frame >= 0 && frame <= 2e9) ||
        (!clip.frame_ids.empty() && !(frame > clip.frame_ids.back()))) {
      lines.fail("frame " + in_quotes(cells[0]), "increasing frame numbers");
    }
    if (static_cast<std::int64_t>(clip.frame_ids.size()) == header.frames) {
      lines.fail("more frames", std::to_string(header.frames) + ", as NumFrames says");
    }
    clip.frame_ids.push_back(saturating_cast<int>(frame));
    Points positions = Points::Zero(static_cast<Index>(count), 3);
    std::vector<bool> seen(count, true);
    for (std::size_t m = 0; m < count; ++m) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::string_view cell = cells[2 + 3 * m + i];
        if (cell.empty() || cell == "nan" || cell == "NaN") {
          seen[m] = false;
        } else {
          positions(static_cast<Index>(m), static_cast<Index>(i)) =
              header.metres_per_unit * lines.number(cell, "a coordinate");
        }
      }
      if (!seen[m]) {
        positions.row(static_cast<Index>(m)).setZero();
      }
    }
    clip.positions.push_back(std::move(positions));
    clip.seen.push_back(std::move(seen));
  }
  if (static_cast<std::int64_t>(clip.frame_ids.size()) != header.frames) {
    lines.fail(std::to_string(clip.frame_ids.size()) + " frames",
               std::to_string(header.frames) + ", as NumFrames says (the file is cut off)");
  }
  return clip;
}

MarkerClip read_trc(const std::filesystem::path& path, const Limits& limits) {
  MarkerClip clip =
      read_trc(read_file_bytes(path, limits.motion_file_bytes), path.string(), limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
