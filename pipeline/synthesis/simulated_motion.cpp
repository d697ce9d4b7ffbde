#include "pipeline/synthesis/simulated_motion.h"

#include <algorithm>

#include "core/error.h"
#include "pipeline/synthesis/performance.h"
#include "pipeline/synthesis/synthesis.h"
#include "pipeline/synthesis/synthesis_stage.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Is it the same person, as far as the ground truth's rounding goes?
bool same_body(const Mesh& one, const Mesh& other) {
  constexpr double kRounding = 1e-5;  // m
  return one.vertices.rows() == other.vertices.rows() &&
         (one.vertices - other.vertices).cwiseAbs().maxCoeff() < kRounding;
}

SimulatedMotion simulated(SynthesisOptions options, const GroundTruth& truth,
                          const std::vector<Camera>& cameras) {
  SimulatedMotion result;
  result.motion = motion_of(options) == "stride" ? "twist" : "stride";
  // Two moments of it, once it has set the cloth in motion. Cloth of fewer substeps than the
  // capture's is as true, only softer, and skin is not judged.
  options.motion = {.motion = result.motion, .duration = 2, .start = 0.5};
  options.frames = 2;
  options.fps = 3;
  options.outfit.substeps = std::min(options.outfit.substeps, 10);
  options.skin_resolution = std::min(options.skin_resolution, 256);
  const Performance performance = cast_performance(options, truth.garments);
  if (!same_body(performance.subject.model.mesh, truth.body)) {
    throw DataError(options.subject.body, "", "another body", "the one of the capture");
  }
  const SynthesisStage stage =
      set_stage(truth_of(performance, options), performance.layers, options);
  perform_clothed(performance, options, nullptr,
                  [&](int i, const PerformedFrame& frame, const PerformanceState&) {
                    result.pictures.push_back(clean_pictures(stage, frame, cameras, options));
                    result.frames.push_back(frame.truth);
                    result.frames.back().frame_id = i;
                  });
  return result;
}

}  // namespace

std::optional<SimulatedMotion> simulate_motion(const fs::path& capture, const GroundTruth& truth,
                                               const std::vector<Camera>& cameras) {
  const std::optional<SynthesisOptions> options = synthesis_options_of(capture);
  if (!options || !options->body_sequence.empty() || truth.garments.empty()) {
    return std::nullopt;
  }
  try {
    return simulated(*options, truth, cameras);
  } catch (const DataError&) {
    return std::nullopt;  // the body's file is gone, or the cloth does not follow
  }
}

}  // namespace atelier
