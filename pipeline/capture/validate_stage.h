#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>

#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "capture/validate.h"
#include "core/store/stage.h"
#include "pipeline/sealing/consent_check.h"

namespace atelier {

/// How to read a capture, what to check of it, and the use that its consent is asked about.
struct ValidateStageOptions {
  DatasetOptions capture;
  ValidateOptions checks;
  ConsentUse use;
};
OptionTable describe(ValidateStageOptions& options);

/// A capture as it is judged: held-out images aside, and without corrections that make it worse
/// (capture/try_corrections.h). Throws as open_dataset.
Dataset judged_dataset(const std::filesystem::path& capture, const ValidateStageOptions& options);

/// What `validate` finds of it, with advice that can be followed at once (try_corrections.h).
Validation judged_validation(FrameReader& reader, const std::filesystem::path& capture,
                             const ValidateStageOptions& options,
                             const std::function<void(int done, int total)>& told = {});

/// The findings as JSON: capture, layout, cameras, frames, consent, findings, settings.
std::string validation_json(const std::string& name, const Dataset& dataset,
                            const Validation& validation);

inline constexpr std::array kValidateMetrics = {
    StageMetric{.name = "errors", .unit = "", .input_errors = true},
    StageMetric{"warnings", ""},
};

/// A capture -> findings.json and validation.html (validate_page.h).
void run_validate(StageRun& run);

}  // namespace atelier
