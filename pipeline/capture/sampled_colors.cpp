#include "pipeline/capture/sampled_colors.h"

#include <algorithm>

#include "core/error.h"

namespace atelier {

SampledColors sample_colors(const Dataset& dataset, const std::string& name, int frames,
                            const ReconstructOptions& reconstruct,
                            const CoarseReconstructionOptions& options,
                            const std::function<void(const std::string&)>& say) {
  const std::vector<int> all = frames_with_masks(dataset);
  if (all.empty()) {
    throw DataError(name, "", "no masks and no labels", "some; atelier masks creates them");
  }
  SampledColors sampled;
  const auto wanted = std::min<std::size_t>(all.size(), static_cast<std::size_t>(frames));
  int first_point = 0;
  for (std::size_t i = 0; i < wanted; ++i) {
    const int frame = all[i * all.size() / wanted];
    const std::vector<InstantView> views = instant_of(dataset, frame);
    std::vector<ColorSample> found;
    try {
      found = color_samples(views, reconstruct, options);
    } catch (const DataError& error) {
      if (!error.file.empty() || (sampled.frames == 0 && i + 1 == wanted)) {
        throw;
      }
      say("frame " + std::to_string(frame) + " is left out: " + error.what());
      continue;
    }
    ++sampled.frames;
    int last_point = 0;
    for (ColorSample sample : found) {
      last_point = std::max(last_point, sample.point + 1);
      sample.point += first_point;
      sample.camera = static_cast<int>(
          camera_index(dataset, views[static_cast<std::size_t>(sample.camera)].camera.id));
      sampled.samples.push_back(sample);
    }
    first_point += last_point;
  }
  return sampled;
}

}  // namespace atelier
