#include "pipeline/cloth/simulate_measures.h"

#include <map>
#include <string>

#include "core/store/result.h"

namespace atelier {

std::vector<Measure> measure_simulate(const std::filesystem::path& workspace,
                                      const std::filesystem::path& /*capture*/) {
  const auto current = current_name(workspace / "simulate");
  if (!current) {
    return {};
  }
  const std::map<std::string, double> metrics =
      read_manifest(workspace / "simulate" / *current, "simulate").metrics;
  std::vector<Measure> measures;
  const auto add = [&](const char* metric, const char* key, double scale, const char* unit,
                       double target, Measure::Side side, const char* note) {
    if (const auto found = metrics.find(metric); found != metrics.end()) {
      measures.push_back({key, scale * found->second, unit, target, side, note});
    }
  };
  using Side = Measure::Side;
  add("held_distance", "simulate.held_mm", 1e3, "mm", 50, Side::AtMost,
      "of waistbands, necklines and the like from where the body carries them, the farthest");
  add("strain_p999", "simulate.strain_p999", 1, "", 0.3, Side::AtMost,
      "99.9th percentile of edge strain, the largest of all frames");
  add("captured_distance", "simulate.registered_mm", 1e3, "mm", 0, Side::None,
      "mean distance from the registered garments, with a fabric's stiffness");
  return measures;
}

}  // namespace atelier
