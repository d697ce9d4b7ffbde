#include "pipeline/chain/run_options.h"

#include <algorithm>

#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

/// The field of that name in the run's table; null if there is none.
const OptionField* field_named(const OptionTable& table, const std::string& name) {
  const auto found = std::find_if(table.fields.begin(), table.fields.end(),
                                  [&](const OptionField& field) { return field.name == name; });
  return found == table.fields.end() ? nullptr : &*found;
}

/// "fps" of "capture.fps" and of "input.capture.fps"; "" of what is no option of the capture.
std::string name_in_capture(const std::string& name) {
  constexpr std::string_view kSection = "capture.";
  const std::size_t at = name.find(kSection);
  const bool whole_word = at == 0 || (at != std::string::npos && name[at - 1] == '.');
  return whole_word ? name.substr(at + kSection.size()) : "";
}

}  // namespace

OptionSet run_options() {
  auto values = std::make_shared<RunOptions>();
  OptionTable table;
  values->capture = option_set<DatasetOptions>();
  table.add("capture", values->capture.table);
  for (const RunStep& step : run_steps()) {
    const Stage* stage = find_stage(all_stages(), step.stage);
    if (stage != nullptr) {
      OptionSet& options = values->stages[std::string(step.stage)] = stage->options();
      table.add(std::string(step.stage), options.table);
    }
  }
  values->report = option_set<ReportOptions>();
  table.add("report", values->report.table);
  return {std::move(values), std::move(table)};
}

OptionSet stage_options(const OptionSet& run, const std::string& stage) {
  OptionSet options = options_of<RunOptions>(run).stages.at(stage);
  for (OptionField& field : options.table.fields) {
    const OptionField* own = field_named(run.table, stage + "." + field.name);
    ATELIER_CHECK(own != nullptr, "no option " + stage + "." + field.name);
    field.source = own->source;
    const std::string name = name_in_capture(field.name);
    const OptionField* shared = name.empty() ? nullptr : field_named(run.table, "capture." + name);
    if (shared != nullptr && shared->source != "default" && field.source == "default") {
      const std::string problem =
          set_option(options.table, field.name, option_text(*shared), shared->source);
      ATELIER_CHECK(problem.empty(), problem);
    }
  }
  return options;
}

}  // namespace atelier
