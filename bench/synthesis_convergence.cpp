// How far the cloth of `atelier synthesize` depends on its substeps. A spinning skirt is chaotic: a
// micrometre at the start grows until two runs differ by centimetres, whatever the substeps are, so
// vertices of two runs cannot be compared. This prints what can: each number of substeps twice, the
// second time from vertices moved by a micrometre. What the pair differs by is chaos; what is left
// of a difference between two numbers of substeps is theirs. docs/results/synthesis.md has the
// table.
//
//   synthesis_convergence [--garment dress] [--motion spin] [--edge_length 0.03] [--substeps 15]...

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>

#include "core/random.h"
#include "pipeline/synthesis/performance.h"

namespace atelier {
namespace {

constexpr double kNudge = 1e-6;  // m, standard deviation of each coordinate

struct Run {
  std::vector<Points> frames;  ///< cloth
  double strain_p50 = 0, strain_p95 = 0;
  double hem_radius = 0, hem_height = 0;  ///< m, means over the lowest opening
  double seconds = 0;                     ///< of the processor
};

/// The opening that hangs lowest.
std::vector<int> hem_of(const Outfit& outfit) {
  std::vector<int> hem;
  double lowest = 1e9;
  for (std::size_t g = 0; g < outfit.garments.size(); ++g) {
    const Garment& garment = outfit.garments[g].garment;
    for (const std::vector<int>& loop : garment.boundaries) {
      double y = 0;
      for (const int v : loop) {
        y += garment.mesh.vertices(v, 1) / static_cast<double>(loop.size());
      }
      if (loop.size() > 2 && y < lowest) {
        lowest = y;
        hem = loop;
        for (int& v : hem) {
          v += static_cast<int>(outfit.first[g]);
        }
      }
    }
  }
  return hem;
}

Run run_of(Performance performance, SynthesisOptions options, int substeps, double nudge) {
  options.outfit.substeps = performance.outfit.solver.substeps = substeps;
  performance.outfit.solver.self_interval = search_interval(substeps);
  Random random{1, 1};
  Points& start = performance.outfit.state.positions;
  for (Index v = 0; v < start.rows(); ++v) {
    for (int c = 0; c < 3; ++c) {
      start(v, c) += nudge * normal(random);
    }
  }
  const std::vector<int> hem = hem_of(performance.outfit);
  const Cloth& cloth = performance.outfit.cloth;
  Run run;
  const std::clock_t begin = std::clock();
  perform_clothed(performance, options, nullptr,
                  [&](int, const PerformedFrame&, const PerformanceState& state) {
                    const Points& x = state.cloth.positions;
                    run.frames.push_back(x);
                    std::vector<double> strains;
                    for (int i = 0; i < cloth.fibre_count; ++i) {
                      const ClothSpring& s = cloth.springs[static_cast<std::size_t>(i)];
                      strains.push_back(std::abs((x.row(s.a) - x.row(s.b)).norm() / s.rest - 1));
                    }
                    std::sort(strains.begin(), strains.end());
                    const double share = 1.0 / options.frames;
                    run.strain_p50 += share * strains[strains.size() / 2];
                    run.strain_p95 += share * strains[strains.size() * 95 / 100];
                    for (const int v : hem) {
                      const double part = share / static_cast<double>(hem.size());
                      run.hem_radius += part * std::hypot(x(v, 0), x(v, 2));
                      run.hem_height += part * x(v, 1);
                    }
                  });
  run.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  return run;
}

/// Mean over frames and vertices, m.
double distance(const Run& a, const Run& b) {
  double sum = 0;
  for (std::size_t f = 0; f < a.frames.size(); ++f) {
    sum += (a.frames[f] - b.frames[f]).rowwise().norm().mean();
  }
  return sum / static_cast<double>(a.frames.size());
}

void print(const SynthesisOptions& options, const std::vector<int>& substeps) {
  const Performance performance = cast_performance(options);
  std::printf("%s, %s, edges of %.0f mm, %ld vertices, %d frames\n", options.outfit.garment.c_str(),
              options.motion.motion.c_str(), 1000 * options.outfit.edge_length,
              static_cast<long>(performance.outfit.cloth.rest_positions.rows()), options.frames);
  std::printf(
      "| substeps | CPU s | strain p50 | p95 | hem's radius | height | to a run nudged by 1 um | "
      "to "
      "the fewest substeps |\n|---|---|---|---|---|---|---|---|\n");
  std::vector<Run> runs;
  for (const int count : substeps) {
    runs.push_back(run_of(performance, options, count, 0));
    const Run nudged = run_of(performance, options, count, kNudge);
    const Run& run = runs.back();
    const auto pair = [](double a, double b, double scale, const char* unit) {
      char text[64];
      std::snprintf(text, sizeof(text), "%.2f, %.2f %s", scale * a, scale * b, unit);
      return std::string(text);
    };
    std::printf("| %d | %.0f | %s | %s | %s | %s | %.1f mm | %.1f mm |\n", count, run.seconds,
                pair(run.strain_p50, nudged.strain_p50, 100, "%").c_str(),
                pair(run.strain_p95, nudged.strain_p95, 100, "%").c_str(),
                pair(run.hem_radius, nudged.hem_radius, 100, "cm").c_str(),
                pair(run.hem_height, nudged.hem_height, 100, "cm").c_str(),
                1000 * distance(run, nudged), 1000 * distance(run, runs.front()));
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  atelier::SynthesisOptions options;
  options.motion.motion = "spin";
  std::vector<int> substeps = {15, 30, 60};
  CLI::App app("Cloth of atelier synthesize by its substeps");
  app.add_option("--garment", options.outfit.garment);
  app.add_option("--motion", options.motion.motion);
  app.add_option("--edge_length", options.outfit.edge_length);
  app.add_option("--frames", options.frames);
  app.add_option("--stretch", options.outfit.stretch);
  app.add_option("--substeps", substeps);
  CLI11_PARSE(app, argc, argv);
  try {
    atelier::print(options, substeps);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
