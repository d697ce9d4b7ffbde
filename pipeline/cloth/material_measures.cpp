#include "pipeline/cloth/material_measures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "core/io/ground_truth_archive.h"
#include "core/store/result.h"
#include "simulation/files/material_file.h"
#include "simulation/material/fabric.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The true garment of a label, or null.
const GroundTruthGarment* true_garment(const GroundTruth& truth, const std::string& label) {
  const auto found = std::find_if(
      truth.garments.begin(), truth.garments.end(),
      [&](const GroundTruthGarment& garment) { return label_name(garment.label) == label; });
  return found == truth.garments.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Measure> measure_material(const fs::path& workspace, const fs::path& capture) {
  const auto current = current_name(workspace / "material");
  if (!current) {
    return {};
  }
  const fs::path result = workspace / "material" / *current;
  const std::map<std::string, double> metrics = read_manifest(result, "material").metrics;
  const auto fitted = metrics.find("fitted");
  if (fitted == metrics.end() || fitted->second == 0) {
    return {};
  }
  const GroundTruth truth = read_ground_truth(capture);
  const StiffnessPrior usual = stiffness_prior();
  std::vector<Measure> each;
  double worst = 0;
  for (const auto& [name, fit] : read_materials(result)) {
    const Material& material = fit.material;
    const GroundTruthGarment* garment = true_garment(truth, name);
    if (garment == nullptr) {
      continue;
    }
    const Material& real = garment->garment.material;
    const auto error = [&](double found, double is) { return std::abs(found / is - 1); };
    const double stretch = error(material.stretch_warp, real.stretch_warp);
    const double bending = error(material.bending, real.bending);
    worst = std::max({worst, stretch, bending});
    const std::string prefix = "material." + name + ".";
    const auto add = [&](const char* what, double value, const char* note) {
      each.push_back({prefix + what, value, "", 0, Measure::Side::None, note});
    };
    const auto inside = [](double low, double is, double high) {
      return low <= is && is <= high ? 1.0 : 0.0;
    };
    add("stretch_error", stretch, "relative");
    add("bending_error", bending, "relative");
    add("stretch_prior_error", error(usual.stretch, real.stretch_warp),
        "of the median of published fabrics, without the capture");
    add("bending_prior_error", error(usual.bending, real.bending), "");
    if (!(fit.credible_low.stretch > 0 && fit.credible_low.bending > 0)) {
      continue;  // a result from before there was such a range
    }
    add("stretch_credible",
        inside(fit.credible_low.stretch, real.stretch_warp, fit.credible_high.stretch),
        "1: the ground truth lies in the 90% credible interval");
    add("bending_credible",
        inside(fit.credible_low.bending, real.bending, fit.credible_high.bending), "");
    add("stretch_range", fit.credible_high.stretch / fit.credible_low.stretch,
        "upper over lower bound of that interval");
    add("bending_range", fit.credible_high.bending / fit.credible_low.bending, "");
  }
  if (!each.empty()) {
    each.insert(each.begin(), {"material.error", worst, "", 0.3, Measure::Side::AtMost,
                               "the largest of stretching and bending, of all garments"});
  }
  return each;
}

}  // namespace atelier
