#include "pipeline/garment/register_holding.h"

#include <cstdio>
#include <string>

#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "pipeline/pictures/ring_tube.h"

namespace atelier {

std::vector<HeldRing> tell_holding(StageRun& run, const FollowedGarment& garment) {
  std::vector<HeldRing> rings = find_holding(garment);
  for (const HeldRing& ring : rings) {
    char text[200];
    if (ring.kind == HoldingKind::Band) {
      std::snprintf(text, sizeof text,
                    ": held by a band of %.0f mm on %.0f mm of body, %.0f mm off the skin, which "
                    "changes its place by %.0f mm",
                    1e3 * ring.rest_girth, 1e3 * ring.body_girth, 1e3 * ring.gap,
                    1e3 * ring.deviation);
    } else {
      std::snprintf(text, sizeof text, ": rests on the body, %.0f mm off the skin", 1e3 * ring.gap);
    }
    run.say(garment.name + " " + ring.opening + text);
  }
  if (rings.empty()) {
    run.warn(garment.name +
             ": no opening goes round the body, so nothing is found that holds it; add a band to "
             "holding.toml and give it as --holding, or it falls in simulations");
  }
  return rings;
}

Image holding_picture(const std::vector<ShownGarment>& garments, const Mesh& body) {
  std::vector<RenderMesh> scene;
  RenderMesh wearer;
  wearer.mesh.vertices = body.vertices;
  wearer.mesh.faces = body.faces;
  wearer.look.color = {0.62F, 0.45F, 0.36F};
  scene.push_back(std::move(wearer));
  std::string caption;
  for (const ShownGarment& garment : garments) {
    RenderMesh cloth;
    cloth.mesh.vertices = garment.mesh.vertices;
    cloth.mesh.faces = garment.mesh.faces;
    cloth.look = clay_look();
    scene.push_back(std::move(cloth));
    for (const HeldRing& ring : garment.rings) {
      RenderMesh line{ring_tube(garment.mesh.vertices, ring.vertices, ring.closed), {}};
      const bool band = ring.kind == HoldingKind::Band;
      line.look.color =
          band ? Eigen::Vector3f(0.8F, 0.05F, 0.05F) : Eigen::Vector3f(0.05F, 0.25F, 0.8F);
      scene.push_back(std::move(line));
      caption += (caption.empty() ? "" : "; ") + ring.garment + " " + ring.opening +
                 (band ? ": band" : ": rests");
    }
  }
  PictureOptions options;
  options.width = 400;
  options.height = 520;
  const Image sheet = contact_sheet(
      {{picture_of(scene, kFront, options), ""}, {picture_of(scene, kBack, options), ""}},
      {.columns = 2});
  return contact_sheet({{sheet, caption.empty() ? "nothing" : caption}},
                       {.columns = 1, .title = "What holds the garments"});
}

}  // namespace atelier
