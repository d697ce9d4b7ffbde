#include "bodymodel/formats/motion_trc.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <set>
#include <utility>

#include "bodymodel/formats/marker_subjects.h"
#include "bodymodel/motion_clip.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/polygon_mesh.h"
#include "core/io/text_scanner.h"
#include "core/median.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

using Cells = std::vector<std::string_view>;

bool is_blank(char c) {
  return c == ' ' || c == '\r' || c == '\t';
}

std::string_view trimmed_cell(std::string_view cell) {
  while (!cell.empty() && is_blank(cell.front())) {
    cell.remove_prefix(1);
  }
  while (!cell.empty() && is_blank(cell.back())) {
    cell.remove_suffix(1);
  }
  return cell;
}

Cells cells_between_blanks(std::string_view line) {
  Cells cells;
  for (line = trimmed_cell(line); !line.empty(); line = trimmed_cell(line)) {
    std::size_t end = 0;
    while (end < line.size() && !is_blank(line[end])) {
      ++end;
    }
    cells.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  if (cells.empty()) {
    cells.emplace_back();  // a blank line has an empty cell
  }
  return cells;
}

// Between tabs; on a line without tabs between commas, as spreadsheets save them, or blanks.
Cells cells_of(std::string_view line) {
  const char separator = line.find('\t') != std::string_view::npos ? '\t' : ',';
  if (line.find(separator) == std::string_view::npos) {
    return cells_between_blanks(line);
  }
  Cells cells;
  for (;;) {
    const std::size_t tab = line.find(separator);
    cells.push_back(trimmed_cell(line.substr(0, tab)));
    if (tab == std::string_view::npos) {
      return cells;
    }
    line.remove_prefix(tab + 1);
  }
}

// How programs write that there is no number: nothing, nan in any case and with any sign, as
// Windows prints it ("-1.#IND", "1.#QNAN", "nan(ind)"), NA, null, none.
bool is_unseen(std::string_view cell) {
  std::string word;
  for (const char c : cell) {
    if (c != '-' && c != '+' && c != '/') {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return word.empty() || word.starts_with("nan") || word == "na" || word == "null" ||
         word == "none" || word.starts_with("1.#ind") || word.starts_with("1.#qnan");
}

// Lines of a text with their numbers, and errors that name them. (Empty cells count here, which is
// why TextScanner's words do not serve.)
class Lines {
 public:
  Lines(std::span<const std::byte> bytes, const std::string& name, const Limits& limits)
      : text_(as_text(bytes)), name_(name), limits_(limits), line_end_(line_end_of(text_)) {
    at_ = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;  // a byte order mark, as spreadsheets write
  }

  bool next(std::string_view& line) {
    if (at_ >= text_.size()) {
      return false;
    }
    const std::size_t end = std::min(text_.find(line_end_, at_), text_.size());
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
      fail(no_number(cell), std::string("a finite number for ") + what);
    }
    return value;
  }

  double metres(std::string_view cell, double metres_per_unit) const {
    const double value = metres_per_unit * number(cell, "a coordinate");
    if (!(std::abs(value) < limits_.mesh_coordinate)) {
      fail(in_quotes(cell), "a coordinate on a stage");
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

  bool at_end() const { return at_ > text_.size(); }  // of a last line without a line end
  std::int64_t line() const { return number_; }

 private:
  std::string_view text_;
  const std::string& name_;
  const Limits& limits_;
  char line_end_;
  std::size_t at_ = 0;
  std::int64_t number_ = 0;
};

struct TrcHeader {
  double fps = 0;
  std::int64_t frames = 0;
  std::int64_t markers = 0;
  double metres_per_unit = 0;
  std::int64_t line = 0;  // of the values
};

// Values below their keys. Some writers line them up by tabs more than one: then the cells that are
// not empty belong together, where there are as many of both.
std::pair<Cells, Cells> read_keys_and_values(Lines& lines) {
  Cells keys = lines.row("DataRate, ...");
  Cells values = lines.row("the header's values");
  Cells full_keys = keys;
  Cells full_values = values;
  std::erase(full_keys, "");
  std::erase(full_values, "");
  if (full_keys.size() == full_values.size()) {
    return {std::move(full_keys), std::move(full_values)};
  }
  return {std::move(keys), std::move(values)};
}

TrcHeader read_trc_header(Lines& lines, const Limits& limits) {
  if (!lines.row("PathFileType").front().starts_with("PathFileType")) {
    lines.fail("no PathFileType", "a TRC file");
  }
  const auto [keys, values] = read_keys_and_values(lines);
  TrcHeader header;
  header.line = lines.line();
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
  if (!(header.fps >= 0)) {
    lines.fail("DataRate " + short_number(header.fps), "more than 0");
  }
  if (header.frames == 0 || header.markers == 0) {
    lines.fail(header.frames == 0 ? "no NumFrames" : "no NumMarkers", "counts of both");
  }
  if (header.metres_per_unit == 0) {
    lines.fail("no Units", "m, cm, mm or in");
  }
  return header;
}

// The names behind "Frame#" and "Time": every third cell between tabs, or one after the other.
std::vector<std::string> read_marker_names(Lines& lines, const TrcHeader& header) {
  const Cells cells = lines.row("the names of the markers");
  std::set<std::string_view> once;
  std::vector<std::string> names;
  for (std::size_t i = 2; i < cells.size(); ++i) {
    if (cells[i].empty()) {
      continue;
    }
    if (!once.insert(cells[i]).second) {
      lines.fail("marker " + in_quotes(cells[i]) + " twice", "each name once");
    }
    names.emplace_back(cells[i]);
  }
  if (std::cmp_not_equal(names.size(), header.markers)) {
    lines.fail(std::to_string(names.size()) + " names of markers",
               std::to_string(header.markers) + ", as NumMarkers says in line " +
                   std::to_string(header.line) + "; correct it, or add the names");
  }
  return names;
}

// A frame: number, time, and three coordinates a marker.
Cells read_row(std::string_view line, std::size_t markers, const Lines& lines) {
  const std::size_t whole = 2 + 3 * markers;
  Cells cells = cells_of(line);
  if (cells.size() != whole) {
    Cells words = cells_between_blanks(line);
    cells = words.size() == whole ? words : cells;
  }
  while (cells.size() > whole && cells.back().empty()) {
    cells.pop_back();  // writers end their rows with a tab
  }
  // Editors strip tabs at the end of a row: the last markers were not seen.
  const bool stripped = cells.size() >= 2 && cells.size() < whole && (cells.size() - 2) % 3 == 0 &&
                        line.find_first_of("\t,") != std::string_view::npos && !lines.at_end();
  if (cells.size() != whole && !stripped) {
    lines.fail(std::to_string(cells.size()) + " cells",
               std::to_string(whole) + ": frame, time and three for each marker (" +
                   std::to_string(markers) + ", as NumMarkers says)");
  }
  cells.resize(whole);
  return cells;
}

void add_row(const Cells& cells, const TrcHeader& header, const Lines& lines, MarkerClip& clip) {
  const std::size_t count = clip.markers.size();
  Points positions = Points::Zero(static_cast<Index>(count), 3);
  std::vector<bool> seen(count, true);
  for (std::size_t m = 0; m < count; ++m) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string_view cell = cells[2 + 3 * m + i];
      if (is_unseen(cell)) {
        seen[m] = false;
      } else {
        positions(static_cast<Index>(m), static_cast<Index>(i)) =
            lines.metres(cell, header.metres_per_unit);
      }
    }
    if (!seen[m]) {
      positions.row(static_cast<Index>(m)).setZero();
    }
  }
  clip.positions.push_back(std::move(positions));
  clip.seen.push_back(std::move(seen));
}

// Whether rows are mostly that far apart.
bool is_near_rate(const std::vector<double>& times, double rate) {
  constexpr double kNear = 0.1;
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    steps.push_back(times[i] - times[i - 1]);
  }
  return !steps.empty() && std::abs(median(std::move(steps)) * rate - 1) < kNear;
}

// Frame numbers that all go on by the same step are rows at the rate divided by it, unless the
// times say that rows are at the rate itself. Frames then go on by 1.
void settle_step(const std::vector<double>& times, MarkerClip& clip) {
  constexpr std::size_t kFewest = 4;  // rows
  int step = 0;
  for (std::size_t i = 1; i < clip.frame_ids.size(); ++i) {
    step = std::gcd(step, clip.frame_ids[i] - clip.frame_ids[i - 1]);
  }
  if (step < 2 || clip.frame_ids.size() < kFewest) {
    return;
  }
  const bool rows_at_rate = !times.empty() && clip.fps > 0 && is_near_rate(times, clip.fps) &&
                            !is_near_rate(times, clip.fps / step);
  for (int& id : clip.frame_ids) {
    id = clip.frame_ids.front() + (id - clip.frame_ids.front()) / step;
  }
  if (!rows_at_rate && clip.fps > 0) {
    clip.fps /= step;
    clip.findings.push_back(
        {Severity::Note, "motion-rate", clip.name, "frame numbers go on by " + std::to_string(step),
         "rows are taken at " + short_number(clip.fps) + " a second; --motion.fps sets another"});
  }
}

// Rows that are left out where frame numbers go on by 1 all the same: the times then jump by whole
// frames, and with these the rows take as long as the rate says.
void number_by_times(const std::vector<double>& times, MarkerClip& clip) {
  constexpr double kJump = 1.75;   // frames; rounded times make steps of 1.5
  constexpr double kAgree = 0.02;  // of the duration
  if (times.empty() || !(clip.fps > 0) || !is_near_rate(times, clip.fps) ||
      clip.frame_ids.back() - clip.frame_ids.front() + 1 != std::ssize(clip.frame_ids)) {
    return;
  }
  std::vector<double> frames = {0};
  bool jumps = false;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double passed = (times[i] - times[i - 1]) * clip.fps;
    jumps = jumps || passed > kJump;
    frames.push_back(frames.back() + (passed > kJump ? std::round(passed) : 1));
  }
  const double whole = (times.back() - times.front()) * clip.fps;
  constexpr double kMost = 2e9;
  if (!jumps || std::abs(frames.back() - whole) > 0.5 + kAgree * whole ||
      clip.frame_ids.front() + frames.back() > kMost) {
    return;
  }
  clip.findings.push_back({Severity::Note, "motion-rate", clip.name,
                           "the column Time leaves out frames that the frame numbers do not",
                           "the times are taken"});
  for (std::size_t i = 1; i < frames.size(); ++i) {
    clip.frame_ids[i] = clip.frame_ids.front() + saturating_cast<int>(frames[i]);
  }
}

// Times that go on at another rate than the header's, by more than rounding makes of them; where
// the header's is 0 (OpenSim writes that where it was told none) they are the rate.
void compare_rates(const std::vector<double>& times, const Lines& lines, MarkerClip& clip) {
  constexpr double kOff = 0.02;
  constexpr double kSlowestRate = 1e-3;  // frames a second
  constexpr double kFastestRate = 1e6;
  const bool unsaid = clip.fps == 0;
  const std::size_t enough = unsaid ? 2 : 10;
  const double seconds = times.size() < enough ? 0 : times.back() - times.front();
  const double frames = times.size() < enough
                            ? 0
                            : static_cast<double>(clip.frame_ids.back() - clip.frame_ids.front());
  char text[120];
  if (unsaid) {
    clip.fps = seconds > 0 ? frame_rate(seconds / frames) : 0;
    if (!(clip.fps > kSlowestRate && clip.fps < kFastestRate)) {
      lines.fail("DataRate 0, and no column Time that goes on", "frames a second, more than 0");
    }
    std::snprintf(text, sizeof text, "DataRate is 0; the column Time goes on at %.6g a second",
                  clip.fps);
    clip.findings.push_back({Severity::Warning, "motion-rate", clip.name, text,
                             "this is taken; --motion.fps sets another"});
    return;
  }
  if (!(seconds > 0) || std::abs(frames / seconds / clip.fps - 1) < kOff) {
    return;
  }
  std::snprintf(text, sizeof text,
                "the column Time goes on at %.4g frames a second, DataRate says %.4g",
                frames / seconds, clip.fps);
  clip.findings.push_back({Severity::Warning, "motion-rate", clip.name, text,
                           "DataRate is taken; --motion.fps sets another"});
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
  clip.markers = read_marker_names(lines, header);
  lines.row("X1, Y1, Z1, ...");
  std::string_view line;
  std::int64_t rows = 0;
  std::vector<double> times;
  while (lines.next(line)) {
    if (line.find_first_not_of(" \t\r,") == std::string_view::npos) {
      continue;
    }
    if (++rows > header.frames) {
      continue;  // counted for the error
    }
    const Cells cells = read_row(line, clip.markers.size(), lines);
    const double frame = lines.number(cells[0], "the frame");
    if (!(frame >= 0 && frame <= 2e9) ||
        (!clip.frame_ids.empty() && !(frame > clip.frame_ids.back()))) {
      lines.fail("frame " + in_quotes(cells[0]), "increasing frame numbers");
    }
    clip.frame_ids.push_back(saturating_cast<int>(frame));
    double time = 0;
    if (parse_number(cells[1], time)) {
      times.push_back(time);
    }
    add_row(cells, header, lines, clip);
  }
  if (rows != header.frames) {
    lines.fail(std::to_string(rows) + " rows of frames",
               std::to_string(header.frames) + ", as NumFrames says in line " +
                   std::to_string(header.line) +
                   (rows < header.frames ? " (the file is cut off)" : ""));
  }
  if (std::cmp_not_equal(times.size(), rows)) {
    times.clear();
  }
  settle_step(times, clip);
  number_by_times(times, clip);
  compare_rates(times, lines, clip);
  name_subjects(clip);
  lose_markers_at_origin(clip);
  return clip;
}

MarkerClip read_trc(const std::filesystem::path& path, const Limits& limits) {
  MarkerClip clip =
      read_trc(read_file_bytes(path, limits.motion_file_bytes), path.string(), limits);
  clip.name = path.stem().string();
  return clip;
}

}  // namespace atelier
