#include "pipeline/view/view_figures.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/limits.h"
#include "core/split_text.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A figure's name in words: "strain_p99" as "strain, 99th percentile (of rest length)".
std::string figure_words(const std::string& name, std::span<const StageMetric> metrics) {
  std::string words;
  std::string unit;
  for (const std::string& word : split_text(name, '_')) {
    if (word.size() > 1 && word[0] == 'p' && std::isdigit(static_cast<unsigned char>(word[1]))) {
      std::string percent = word.substr(1);
      if (percent.size() > 2) {
        percent.insert(2, ".");
      }
      words += percent == "50" ? ", median" : ", " + percent + "th percentile";
    } else if (word == "m" || word == "rad" || word == "j") {
      unit = word == "j" ? "J" : word;
    } else {
      words += (words.empty() ? "" : " ") + word;
    }
  }
  const auto metric = std::find_if(metrics.begin(), metrics.end(),
                                   [&](const StageMetric& one) { return one.name == name; });
  if (metric != metrics.end()) {
    unit = metric->unit;
    // A metric sums up the frames; here it is the number of one.
    for (const std::string_view all : {", in all frames", ", all frames"}) {
      if (unit.ends_with(all)) {
        unit.resize(unit.size() - all.size());
      }
    }
  }
  return words + (unit.empty() ? "" : " (" + unit + ")");
}

/// Adds the numbers of a JSON object {"000000": {"name": 1.5}} as series.
void add_figures(ViewTimeline& timeline, const nlohmann::json& frames, const FigureSource& source,
                 const std::string& of) {
  std::map<std::string, ViewSeries> series;
  for (const auto& [frame, values] : frames.items()) {
    int id = -1;
    std::from_chars(frame.data(), frame.data() + frame.size(), id);
    if (!values.is_object()) {
      continue;
    }
    for (const auto& [name, value] : values.items()) {
      if (value.is_number()) {
        ViewSeries& one = series[name];
        one.frame_ids.push_back(id);
        one.values.push_back(value.get<double>());
      }
    }
  }
  for (auto& [name, one] : series) {
    one.name = (of.empty() ? "" : of + ": ") + figure_words(name, source.metrics);
    one.stage = source.stage;
    timeline.series.push_back(std::move(one));
  }
}

}  // namespace

void add_figures_file(ViewTimeline& timeline, const fs::path& file, const FigureSource& source) {
  if (!fs::exists(file)) {
    return;
  }
  const nlohmann::json json =
      parse_json(read_file_text(file, Limits{}.text_file_bytes), file.string());
  if (json.contains("frames")) {
    add_figures(timeline, json["frames"], source, "");
    return;
  }
  for (const auto& [garment, content] : json.items()) {
    if (content.is_object() && content.contains("frames")) {
      add_figures(timeline, content["frames"], source, garment);
    }
  }
}

void add_table(ViewTimeline& timeline, const fs::path& file, const FigureSource& source) {
  if (!fs::exists(file)) {
    return;
  }
  const std::vector<std::string> lines =
      split_text(read_file_text(file, Limits{}.text_file_bytes), '\n');
  const std::vector<std::string> names = lines.empty() ? lines : split_text(lines.front(), ',');
  for (std::size_t column = 2; column < names.size(); ++column) {  // behind frame and time
    ViewSeries series{figure_words(names[column], source.metrics), source.stage, {}, {}};
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const std::vector<std::string> cells = split_text(lines[i], ',');
      if (column < cells.size() && !cells[column].empty()) {
        series.frame_ids.push_back(std::atoi(cells[0].c_str()));
        series.values.push_back(std::atof(cells[column].c_str()));
      }
    }
    if (!series.values.empty()) {
      timeline.series.push_back(std::move(series));
    }
  }
}

void add_track(ViewTimeline& timeline, const TrackedMotion& tracked) {
  const std::vector<int>& ids = tracked.motion.frame_ids;
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values) {
    timeline.series.push_back({name, "track", ids, {values.begin(), values.end()}});
  };
  if (tracked.deviations.cols() > 0) {
    add("standard deviation of joints, mean (m)", tracked.deviations.rowwise().mean());
    add("standard deviation of joints, largest (m)", tracked.deviations.rowwise().maxCoeff());
  }
  if ((tracked.keypoint_rms.array() > 0).any()) {
    add("keypoints to the fit, root mean square (m)", tracked.keypoint_rms);
  }
  if ((tracked.scan_rms.array() > 0).any()) {
    add("scan to the fit, root mean square (m)", tracked.scan_rms);
  }
  for (std::size_t i = 0; i < tracked.trusted.size(); ++i) {
    const std::size_t first = i;
    while (i < tracked.trusted.size() && tracked.trusted[i] == 0) {
      ++i;
    }
    if (i > first) {
      const std::string run =
          std::to_string(ids[first]) + (i > first + 1 ? " to " + std::to_string(ids[i - 1]) : "");
      timeline.marks.push_back(
          {Severity::Note,
           (i > first + 1 ? "frames " : "frame ") + run +
               ": bridged from those around; too little was seen, or it did not agree",
           "track", ids[first], ""});
    }
  }
}

}  // namespace atelier
