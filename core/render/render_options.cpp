#include "core/render/render.h"

namespace atelier {

OptionTable describe(RenderOptions& options) {
  OptionTable table;
  table.add("samples", options.samples, 1, 1024, "",
            "rays per pixel: edges and textures; fewer for previews, more for print");
  table.add("shadow_samples", options.shadow_samples, 1, 256, "",
            "rays to each area light per sample; more where large lights look grainy");
  table.add("penumbra_samples", options.penumbra_samples, 0, 256, "",
            "further rays where a pixel lies in a half shadow");
  table.add("ambient_samples", options.ambient_samples, 1, 1024, "",
            "environment rays per sample where its light is not gathered per vertex");
  table.add("alpha", options.alpha, "a fourth channel with the coverage, no background");
  table.add("seed", options.seed, 0, 9e15, "", "of the random numbers");
  return table;
}

}  // namespace atelier
