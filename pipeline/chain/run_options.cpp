#include "pipeline/chain/run_options.h"

#include "core/error.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/row/option_rules.h"

namespace atelier {
namespace {

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
  for (const StageRow* step : run_steps()) {
    const std::string name(step->stage.name);
    OptionSet& options = values->stages[name] = step->stage.options();
    table.add(name, options.table);
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

DatasetOptions capture_options(const OptionTable& stage) {
  DatasetOptions options;
  OptionTable table = describe(options);
  for (const OptionField& field : stage.fields) {
    const std::string name = name_in_capture(field.name);
    if (!name.empty() && field_named(table, name) != nullptr) {
      const std::string problem = set_option(table, name, option_text(field), field.source);
      ATELIER_CHECK(problem.empty(), problem);
    }
  }
  return options;
}

}  // namespace atelier
