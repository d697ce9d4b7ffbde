#include "core/render/framing.h"
#include "core/render/render.h"
#include "core/render/studio.h"
#include "core/render/video.h"

namespace atelier {

OptionTable describe(RenderOptions& options) {
  OptionTable table;
  table.add(
      "samples", options.samples, 1, 1024, "",
      "Number of rays of a pixel, for edges and textures; fewer for previews, more for print");
  table.add(
      "shadow_samples", options.shadow_samples, 1, 256, "",
      "Number of rays to each area light for each sample; more where large lights look grainy");
  table.add("penumbra_samples", options.penumbra_samples, 0, 256, "",
            "Number of additional rays where a pixel lies in a penumbra");
  table.add(
      "ambient_samples", options.ambient_samples, 1, 1024, "",
      "Number of environment rays for each sample where ambient light is not gathered at vertices");
  table.add("alpha", options.alpha,
            "Alpha channel with the coverage of each pixel instead of a background");
  table.add("seed", options.seed, 0, 9e15, "", "Seed of the random numbers");
  return table;
}

OptionTable describe(PrepareOptions& options) {
  OptionTable table;
  table.add("vertex_samples", options.vertex_samples, 1, 65536, "",
            "Number of environment rays for each side of a vertex; more where soft shading looks "
            "blotchy");
  table.add("ground_reach", options.ground_reach, 0, 1000, "m",
            "Half side of the square in which ambient occlusion of the ground is resolved; 0: the "
            "whole ground");
  table.add("ground_shadow_rays", options.ground_shadow_rays, 0, 1024, "",
            "Number of rays to each area light from points of a seamless ground; 0: from every "
            "pixel instead");
  table.add("ground_shadow_reach", options.ground_shadow_reach, 1, 50, "m",
            "Half side of the square in which these points lie");
  table.add("seed", options.seed, 0, 9e15, "", "Seed of the random numbers");
  return table;
}

OptionTable describe(FramingOptions& options) {
  OptionTable table;
  table.add("field_of_view", options.field_of_view, 0.01, 2.9, "rad",
            "Field of view along the longer side of the image; larger for a wide-angle look");
  table.add("margin", options.margin, 0, 0.45, "",
            "Margin left free on each side, as a fraction of the image");
  return table;
}

OptionTable describe(PictureOptions& options) {
  OptionTable table;
  table.add("width", options.width, 1, 16384, "px", "Width of the image");
  table.add("height", options.height, 1, 16384, "px", "Height of the image");
  table.add("samples", options.samples, 1, 1024, "",
            "Number of rays of a pixel: 4 for previews, 32 for print");
  table.add("framing", describe(options.framing));
  return table;
}

OptionTable describe(VideoOptions& options) {
  OptionTable table;
  table.add("fps", options.fps, 0.1, 1000, "1/s", "Frame rate of the video");
  table.add(
      "quality", options.quality, 0, 51, "",
      "Constant rate factor of x264: 20 is hard to tell from the source, 28 makes small files");
  return table;
}

}  // namespace atelier
