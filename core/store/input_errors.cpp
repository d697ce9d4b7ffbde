#include "core/store/input_errors.h"

#include "core/quantity_text.h"

namespace atelier {

std::string input_errors_text(const Stage& stage, const Manifest& manifest) {
  std::string text;
  for (const StageMetric& metric : stage.metrics) {
    const auto found = manifest.metrics.find(std::string(metric.name));
    if (metric.input_errors && found != manifest.metrics.end() && found->second > 0) {
      text += (text.empty() ? "" : ", ") + short_number(found->second) + " " +
              std::string(metric.name) +
              (metric.unit.empty() ? "" : " (" + std::string(metric.unit) + ")");
    }
  }
  return text;
}

}  // namespace atelier
