#include "pipeline/stages/stages.h"

#include <algorithm>
#include <vector>

#include "core/device.h"
#include "core/error.h"

namespace atelier {
namespace {

using Rows = std::vector<const StageRow*>;

/// In the order of the pipeline: as linked, but those that are to be behind another.
Rows ordered_rows() {
  Rows rows;
  Rows waiting;
  for (const StageRow* row : linked_stage_rows()) {
    (row->after.empty() ? rows : waiting).push_back(row);
  }
  for (const StageRow* row : waiting) {
    const auto before = std::find_if(rows.begin(), rows.end(), [&](const StageRow* one) {
      return one->stage.name == row->after;
    });
    rows.insert(before == rows.end() ? before : before + 1, row);
  }
  return rows;
}

}  // namespace

std::span<const StageRow* const> all_rows() {
  static const Rows rows = ordered_rows();
  return rows;
}

std::span<const Stage> all_stages() {
  static const std::vector<Stage> stages = [] {
    std::vector<Stage> all;
    for (const StageRow* row : all_rows()) {
      all.push_back(row->stage);
    }
    return all;
  }();
  return stages;
}

const StageRow* find_row(std::string_view stage) {
  for (const StageRow* row : all_rows()) {
    if (row->stage.name == stage) {
      return row;
    }
  }
  return nullptr;
}

void require_startable(const Stage& stage, const StageRequest& request) {
  check_device(request.device);
  const StageRow* row = find_row(stage.name);
  if (row != nullptr && row->require_startable != nullptr) {
    row->require_startable(request);
  }
}

std::vector<std::string> previewed_warnings(const Stage& stage, const StageRequest& request) {
  const StageRow* row = find_row(stage.name);
  std::vector<std::string> warnings;
  if (row != nullptr && row->preview != nullptr) {
    for (const Finding& finding : row->preview(request)) {
      if (finding.severity != Severity::Note) {
        warnings.push_back(warning_text(finding));
      }
    }
  }
  return warnings;
}

}  // namespace atelier
