#include "pipeline/evaluation/targets.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/io/cameras_file.h"
#include "core/store/result.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

using enum Measure::Side;

const Target* target_of(std::string_view key) {
  const std::span<const Target> targets = all_targets();
  const auto found = std::find_if(targets.begin(), targets.end(),
                                  [&](const Target& target) { return target.key == key; });
  return found == targets.end() ? nullptr : &*found;
}

/// Fills a row with the judgement of a measure.
void judge(Judged& row, const Measure& measure) {
  row.value = measure.value;
  row.target = target_text(measure.side, measure.target);
  row.verdict = measure.side == None ? "not judged" : is_met(measure) ? "met" : "missed";
  row.missed_by = row.verdict == "missed" ? std::abs(measure.value - measure.target) : 0;
  row.why = measure.note;
  row.side = measure.side;
  row.limit = measure.target;
}

/// What a figure that is in no row of the table is, "appearance.dress_psnr_db": the row's words and
/// whose alone. "" where no row of its stage ends its key.
std::string words_without_row(const std::string& key) {
  for (const Target& target : all_targets()) {
    const std::size_t dot = target.key.find('.') + 1;
    const std::string_view name = target.key.substr(dot);
    if (key.size() > target.key.size() && key.starts_with(target.key.substr(0, dot)) &&
        key.ends_with(name)) {
      const std::size_t end = key.size() - name.size() - 1;
      if (key[end] == '.' || key[end] == '_') {
        return std::string(target.words) + ", of " + key.substr(dot, end - dot) + " alone";
      }
    }
  }
  return "";
}

}  // namespace

std::span<const Target> all_targets() {
  static const std::vector<Target> targets = [] {
    std::vector<Target> all;
    for (const StageRow* row : linked_stage_rows()) {
      for (Target target : row->targets) {
        target.stage = row->stage.name;
        all.push_back(target);
      }
    }
    return all;
  }();
  return targets;
}

std::string target_text(Measure::Side side, double target) {
  if (side == None) {
    return "none";
  }
  char text[60];
  std::snprintf(text, sizeof(text), "at %s %g", side == AtMost ? "most" : "least", target);
  return text;
}

Measure against(const Measure& measure, Targets targets) {
  Measure judged = measure;
  if (targets == Targets::Accuracy || measure.key.starts_with("capture.")) {
    return judged;
  }
  const Target* target = target_of(measure.key);
  const bool has_range = target != nullptr && target->demo;
  judged.side = has_range ? target->side : None;
  judged.target = has_range ? *target->demo : 0;
  return judged;
}

std::vector<Judged> judged(std::span<const Measure> measures, Targets targets,
                           const std::filesystem::path& workspace) {
  std::vector<Judged> rows;
  for (const Target& target : all_targets()) {
    if (!find_row(target.stage)->chain &&
        !current_name(results_of_stage(workspace, target.stage))) {
      continue;  // `run` does not come by it: what nobody asked for is not missing
    }
    Judged row;
    row.key = target.key;
    row.stage = target.stage;
    row.words = target.words;
    row.unit = target.unit;
    const auto found = std::find_if(measures.begin(), measures.end(),
                                    [&](const Measure& one) { return one.key == target.key; });
    if (found != measures.end()) {
      judge(row, against(*found, targets));
    } else {
      const bool judged = targets == Targets::Accuracy || target.demo;
      row.target =
          target_text(judged ? target.side : None,
                      targets == Targets::Accuracy ? target.accuracy : target.demo.value_or(0));
      row.verdict = "not measured";
      row.why = current_name(results_of_stage(workspace, target.stage))
                    ? std::string(target.absent)
                    : "there is no result of " + std::string(target.stage);
    }
    rows.push_back(std::move(row));
  }
  // Figures that are judged and not in the table, as each garment's own, count as well.
  for (const Measure& own : measures) {
    const Measure measure = against(own, targets);
    if (measure.side != None && target_of(measure.key) == nullptr) {
      Judged row;
      row.key = measure.key;
      row.stage = measure.key.substr(0, measure.key.find('.'));
      row.words = words_without_row(measure.key);
      row.unit = measure.unit;
      judge(row, measure);
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

Targets targets_named(const std::string& name, const std::filesystem::path& capture) {
  constexpr double kAccuracyPixels = 5e5;
  if (name != "auto") {
    return name == "demo" ? Targets::Demo : Targets::Accuracy;
  }
  double pixels = 0;
  for (const Camera& camera : read_cameras(capture)) {
    pixels = std::max(pixels, static_cast<double>(camera.width) * camera.height);
  }
  return pixels < kAccuracyPixels ? Targets::Demo : Targets::Accuracy;
}

}  // namespace atelier
