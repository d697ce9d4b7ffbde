#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/measure.h"
#include "core/options.h"
#include "core/store/stage.h"
#include "pipeline/row/report_places.h"

namespace atelier {

/// What each number is clamped to.
struct ToyOptions {
  double low = 0;
  double high = 10;
};

OptionTable describe(ToyOptions& options);

inline constexpr std::array kToyMetrics = {StageMetric{"sum", ""}};

/// A text file of numbers -> clamped/<i>.txt, one each, and sum.txt. Throws DataError for a file
/// without numbers.
void run_toy(StageRun& run);

/// "toy.error": how far the sum is from that of a ground truth, TRUTH/sum.txt.
std::vector<Measure> measure_toy(const std::filesystem::path& workspace,
                                 const std::filesystem::path& truth);

/// The sum, as a paragraph.
std::string toy_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
