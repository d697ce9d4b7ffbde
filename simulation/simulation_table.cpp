#include "simulation/simulation_table.h"

#include <cmath>
#include <cstdio>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "simulation/cloth_state_archive.h"

namespace atelier {
namespace {

constexpr const char* kSimulatedSchema = "atelier.simulated_frame";

void set_frame_number(FrameReport& report, const FrameColumn& column, double value) {
  if (const auto* count = std::get_if<int FrameReport::*>(&column.member)) {
    report.** count = saturating_cast<int>(value);
  } else {
    report.*std::get<double FrameReport::*>(column.member) = value;
  }
}

double report_number(const Archive& archive, const FrameColumn& column, const std::string& file) {
  const auto found = archive.numbers.find(column.name);
  if (found == archive.numbers.end()) {
    if (column.later) {
      return -1;
    }
    throw DataError(file, column.name, "no such number", "the frame's report");
  }
  const double value = found->second;
  const bool count = std::holds_alternative<int FrameReport::*>(column.member);
  constexpr double kMost = 2147483647;
  if (!std::isfinite(value) ||
      (count && !(value >= -1 && value <= kMost && value == std::floor(value)))) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%g", value);
    throw DataError(file, column.name, text.data(), count ? "a count, or -1" : "a finite number");
  }
  return value;
}

}  // namespace

double frame_number(const FrameReport& report, const FrameColumn& column) {
  if (const auto* count = std::get_if<int FrameReport::*>(&column.member)) {
    return report.**count;
  }
  return report.*std::get<double FrameReport::*>(column.member);
}

std::string frames_csv(const std::vector<FrameReport>& reports, double fps) {
  std::string text = "frame,seconds";
  for (const FrameColumn& column : kFrameColumns) {
    text += std::string(",") + column.name;
  }
  text += "\n";
  char number[40];
  for (const FrameReport& report : reports) {
    std::snprintf(number, sizeof number, "%lld,%.9g", static_cast<long long>(report.frame),
                  static_cast<double>(report.frame) / fps);
    text += number;
    for (const FrameColumn& column : kFrameColumns) {
      const double value = frame_number(report, column);
      number[0] = 0;
      if (value >= 0) {
        std::snprintf(number, sizeof number, "%.9g", value);
      }
      text += std::string(",") + number;
    }
    text += "\n";
  }
  return text;
}

Archive archive_of(const SimulatedFrame& frame) {
  Archive archive;
  archive.schema = kSimulatedSchema;
  put_cloth_state(archive, "frame", frame.state);
  for (const FrameColumn& column : kFrameColumns) {
    archive.numbers[column.name] = frame_number(frame.report, column);
  }
  return archive;
}

SimulatedFrame simulated_frame_of(const Archive& archive, Index vertices, const std::string& file) {
  SimulatedFrame frame;
  frame.state = cloth_state_at(archive, "frame", vertices, file);
  frame.report.frame = frame.state.frame;
  for (const FrameColumn& column : kFrameColumns) {
    set_frame_number(frame.report, column, report_number(archive, column, file));
  }
  return frame;
}

SimulatedFrame read_simulated_frame(const std::filesystem::path& file, int frame, Index vertices) {
  SimulatedFrame read =
      simulated_frame_of(read_archive(file, kSimulatedSchema, 1), vertices, file.string());
  if (read.state.frame != frame) {
    throw DataError(file.string(), "frame", std::to_string(read.state.frame),
                    std::to_string(frame) + ", as the file is named");
  }
  return read;
}

}  // namespace atelier
