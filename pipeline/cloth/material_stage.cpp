#include "pipeline/cloth/material_stage.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/parallel.h"
#include "pipeline/cloth/material_grid.h"
#include "pipeline/outfit/held_cloth.h"
#include "simulation/files/material_file.h"

namespace atelier {
namespace {

/// The likely range, and how much of it the capture says.
std::string ranges_text(double low, double high, const StiffnessRange& tenth,
                        const StiffnessRange& range) {
  return number_text(low) + " to " + number_text(high) + " likely; " + range_text(tenth) +
         " within 10 % of the nearest trial, " + range_text(range) + " do as well";
}

/// What the capture shows of the last frame; nothing, with a word, where it shows nothing.
std::optional<TakenGarments> taken_beside(StageRun& run, const Trials& trials) {
  std::string why = "no camera has a picture of frame " + std::to_string(trials.frame_ids.back());
  try {
    const auto& options = run.options<MaterialStageOptions>();
    if (auto taken = taken_garments(open_dataset(run.input("capture"), options.capture), trials)) {
      return taken;
    }
  } catch (const DataError& error) {
    why = error.what();
  }
  run.warn("grid.png has no picture of the capture beside it: " + why);
  return std::nullopt;
}

void give_fit_metrics(StageRun& run, const std::vector<StiffnessFit>& fits) {
  const StiffnessFit& first = fits.front();
  double distance = 0;
  double trials = 0;
  for (const StiffnessFit& fit : fits) {
    distance += fit.distance / static_cast<double>(fits.size());
    trials = std::max(trials, static_cast<double>(fit.trials.size()));
  }
  run.metric("trials", trials);
  run.metric("distance", distance);
  run.metric("stretch", first.expected.stretch);
  run.metric("bending", first.expected.bending);
  run.metric("stretch_low", first.credible_low.stretch);
  run.metric("stretch_high", first.credible_high.stretch);
  run.metric("bending_low", first.credible_low.bending);
  run.metric("bending_high", first.credible_high.bending);
}

/// Fits every garment; empty if the run was told to stop.
std::vector<StiffnessFit> fit_garments(StageRun& run, const Trials& trials) {
  const auto& options = run.options<MaterialStageOptions>();
  const auto coarse = static_cast<std::size_t>(options.search.coarse);
  const auto expected = static_cast<std::int64_t>(coarse * coarse) +
                        static_cast<std::int64_t>(options.search.fine) * options.search.fine;
  std::atomic<bool> stopped = false;
  std::atomic<std::int64_t> done = 0;
  Image grid;
  const std::optional<TakenGarments> taken = taken_beside(run, trials);
  const auto start = std::chrono::steady_clock::now();
  run.progress(0, expected, "simulations");
  const StiffnessObjective objective = [&](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<SceneResult> results(scenes.size());
    parallel_for(static_cast<Index>(scenes.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        stopped = stopped || run.stop_requested();
        const auto n = static_cast<std::size_t>(i);
        results[n] = run_scene(trials, scenes[n], stopped);
        run.progress(++done, expected, "simulations");
      }
    });
    if (grid.data.empty() && !stopped) {
      grid = material_grid(trials, scenes, results, options.search.coarse, taken);
    }
    std::vector<std::vector<double>> distances;
    distances.reserve(results.size());
    for (SceneResult& result : results) {
      distances.push_back(stopped ? std::vector<double>(trials.garments.size(), 0.0)
                                  : std::move(result.distances));
    }
    return distances;
  };
  StiffnessSearchOptions search = options.search;
  search.prior = options.use_prior ? stiffness_prior() : StiffnessPrior{};
  std::vector<StiffnessFit> fits =
      search_stiffness(static_cast<int>(trials.garments.size()), objective, search);
  if (stopped) {
    return {};
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.metric("seconds_a_trial", seconds / static_cast<double>(std::max<std::int64_t>(1, done)));
  run.output_text("grid.png", image_bytes(grid, ImageFormat::Png));
  return fits;
}

}  // namespace

void run_material(StageRun& run) {
  const auto& options = run.options<MaterialStageOptions>();
  std::vector<RegisteredGarmentSequence> outfit =
      read_registered_outfit(run.input("template"), run.input("registered"));
  const bool fitted = options.material.name == "fitted";
  std::vector<StiffnessFit> fits;
  if (fitted) {
    hold_outfit(outfit, options.holding, run.input("registered"));
    const Trials trials = read_trials(run, outfit);
    fits = fit_garments(run, trials);
    if (fits.empty()) {
      return;
    }
    run.metric("frames", static_cast<double>(trials.steps.size()));
    give_fit_metrics(run, fits);
  }
  std::vector<GarmentMaterial> found;
  for (std::size_t g = 0; g < outfit.size(); ++g) {
    GarmentMaterial one{outfit[g].name, resolve_material(options.material), {}};
    if (fitted) {
      const StiffnessFit& fit = one.fit.emplace(std::move(fits[g]));
      one.material.stretch_warp = one.material.stretch_weft = fit.expected.stretch;
      one.material.bending = fit.expected.bending;
      run.say(outfit[g].name + ": stretching " + number_text(fit.expected.stretch) + " N/m (" +
              ranges_text(fit.credible_low.stretch, fit.credible_high.stretch,
                          range_within(fit.trials, kTenth, &Stiffness::stretch), fit.stretch) +
              "), bending " + number_text(fit.expected.bending) + " N m (" +
              ranges_text(fit.credible_low.bending, fit.credible_high.bending,
                          range_within(fit.trials, kTenth, &Stiffness::bending), fit.bending) +
              "); " + number_text(1e3 * fit.distance) + " mm from the registered shape");
    }
    found.push_back(std::move(one));
  }
  run.output_text("material.json", materials_text(found));
  run.metric("garments", static_cast<double>(outfit.size()));
  run.metric("fitted", fitted ? 1 : 0);
}

}  // namespace atelier
