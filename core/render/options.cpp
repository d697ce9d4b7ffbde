#include "core/render/framing.h"
#include "core/render/render.h"
#include "core/render/studio.h"
#include "core/render/video.h"

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

OptionTable describe(PrepareOptions& options) {
  OptionTable table;
  table.add("vertex_samples", options.vertex_samples, 1, 65536, "",
            "environment rays per vertex and side; more where soft shading looks blotchy");
  table.add("ground_reach", options.ground_reach, 0, 1000, "m",
            "half side of the square in which the ground's occlusion is resolved; 0: all of it");
  table.add("ground_shadow_rays", options.ground_shadow_rays, 0, 1024, "",
            "rays to each area light from points of a seamless ground; 0: from every pixel");
  table.add("ground_shadow_reach", options.ground_shadow_reach, 1, 50, "m",
            "half side of the square in which these points lie");
  table.add("seed", options.seed, 0, 9e15, "", "of the random numbers");
  return table;
}

OptionTable describe(FramingOptions& options) {
  OptionTable table;
  table.add("field_of_view", options.field_of_view, 0.01, 2.9, "rad",
            "of the picture's longer side; larger for a wide-angle look");
  table.add("margin", options.margin, 0, 0.45, "",
            "left free on each side, as a share of the picture");
  return table;
}

OptionTable describe(PictureOptions& options) {
  OptionTable table;
  table.add("width", options.width, 1, 16384, "px", "of the picture");
  table.add("height", options.height, 1, 16384, "px", "of the picture");
  table.add("samples", options.samples, 1, 1024, "",
            "rays per pixel: 4 for previews, 32 for print");
  table.add("framing", describe(options.framing));
  return table;
}

OptionTable describe(VideoOptions& options) {
  OptionTable table;
  table.add("fps", options.fps, 0.1, 1000, "1/s", "frames per second");
  table.add("quality", options.quality, 0, 51, "",
            "x264's constant rate factor: 20 is hard to tell from the source, 28 is small");
  return table;
}

}  // namespace atelier
