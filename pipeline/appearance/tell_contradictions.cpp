#include "pipeline/appearance/tell_contradictions.h"

#include <algorithm>
#include <cstdio>

namespace atelier {

void tell_contradictions(StageRun& run, const AppearanceData& data, const StaticFit& fit) {
  for (const std::size_t c : contradicting_cameras(fit)) {
    char text[320];
    std::snprintf(text, sizeof(text),
                  "%s: images of camera %s contradict the geometry: a texture for all cameras "
                  "reaches %.1f dB there and explains %.0f%% of their variation (%.1f dB over all "
                  "cameras); check that they are of this camera and its calibration",
                  data.name.c_str(), data.camera_ids[c].c_str(), fit.camera_psnr[c],
                  100 * std::max(fit.camera_explained[c], 0.0), fit.psnr);
    run.warn(text);
  }
}

}  // namespace atelier
