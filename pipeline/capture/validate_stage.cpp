#include "pipeline/capture/validate_stage.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "capture/try_corrections.h"
#include "core/io/json_text.h"
#include "pipeline/pictures/validate_page.h"

namespace atelier {

OptionTable describe(ValidateStageOptions& options) {
  OptionTable table;
  table.add("capture", describe(options.capture));
  table.add(describe(options.checks));
  OptionTable use = describe(options.use);
  for (OptionField& field : use.fields) {
    field.keyed = true;  // what is found depends on them
  }
  table.add(use);
  return table;
}

namespace {

Dataset opened(const std::filesystem::path& capture, const DatasetOptions& options) {
  return without_held_out_pictures(open_dataset(capture, options));
}

Reopen reopening(const std::filesystem::path& capture, const ValidateStageOptions& options) {
  return [&](const std::map<std::string, std::string>& corrections) {
    DatasetOptions chosen = options.capture;
    chosen.corrections = corrections_of(corrections);
    return opened(capture, chosen);
  };
}

}  // namespace

Dataset judged_dataset(const std::filesystem::path& capture, const ValidateStageOptions& options) {
  return without_wrong_corrections(opened(capture, options.capture), reopening(capture, options),
                                   options.checks.keypoints);
}

Validation judged_validation(FrameReader& reader, const std::filesystem::path& capture,
                             const ValidateStageOptions& options,
                             const std::function<void(int done, int total)>& told) {
  Validation validation = validate(reader, options.checks, told);
  validation.findings =
      with_advice_that_joins(std::move(validation.findings), reader.dataset(),
                             reopening(capture, options), options.checks.keypoints);
  const Dataset& dataset = reader.dataset();
  for (Finding& finding :
       consent_findings(dataset.info.consent, options.use, dataset.root.string())) {
    validation.findings.push_back(std::move(finding));
  }
  std::stable_sort(validation.findings.begin(), validation.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
  return validation;
}

std::string validation_json(const std::string& name, const Dataset& dataset,
                            const Validation& validation) {
  nlohmann::ordered_json json = {{"capture", name},
                                 {"layout", dataset.layout},
                                 {"evidence", dataset.evidence},
                                 {"cameras", dataset.cameras.size()},
                                 {"frames", frame_ids(dataset).size()},
                                 {"consent", to_string(dataset.info.consent)}};
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : validation.findings) {
    json["findings"].push_back({{"severity", severity_name(finding.severity)},
                                {"code", finding.code},
                                {"place", finding.place},
                                {"what", finding.what},
                                {"advice", finding.advice},
                                {"setting", finding.setting}});
  }
  json["settings"] = settings_of(validation.findings);
  return json_text(json, 1) + "\n";
}

void run_validate(StageRun& run) {
  const auto& options = run.options<ValidateStageOptions>();
  const std::filesystem::path& capture = run.input("capture");
  FrameReader reader(judged_dataset(capture, options));
  const Validation validation = judged_validation(
      reader, capture, options, [&](int done, int total) { run.progress(done, total, "images"); });
  if (run.stop_requested()) {
    return;
  }
  for (const Finding& finding : validation.findings) {
    if (finding.severity != Severity::Note) {
      run.warn(to_string(finding));
    }
  }
  const std::string name = capture.filename().string();
  run.output_text("findings.json", validation_json(name, reader.dataset(), validation));
  run.output_text("validation.html", validate_page(reader, validation, name));
  const auto count = [&](Severity severity) {
    return static_cast<double>(
        std::count_if(validation.findings.begin(), validation.findings.end(),
                      [&](const Finding& finding) { return finding.severity == severity; }));
  };
  run.metric("errors", count(Severity::Error));
  run.metric("warnings", count(Severity::Warning));
}

}  // namespace atelier
