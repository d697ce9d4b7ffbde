#include "pipeline/pictures/taken_and_drawn.h"

#include <utility>

#include "core/render/contact_sheet.h"
#include "pipeline/pictures/paint_scene.h"

namespace atelier {

std::optional<Image> taken_and_drawn(const WornSubject& worn,
                                     const std::map<std::size_t, std::string>& models,
                                     const std::vector<TakenView>& views, Device device,
                                     const std::function<bool()>& stop) {
  PaintedScene scene;
  for (std::size_t s = 0; s < worn.templates.size(); ++s) {
    SceneLayer layer;
    layer.name = worn.subject.names[s];
    layer.faces = worn.subject.faces[s];
    layer.model = models.contains(s) ? models.at(s) : "";
    scene.layers.push_back(std::move(layer));
  }
  for (const TakenView& view : views) {
    scene.cameras.push_back(view.camera);
    scene.frame_ids.push_back(static_cast<int>(scene.frame_ids.size()));
    scene.vertices.push_back(worn.subject.load(view.frame_id));
  }
  std::vector<CaptionedImage> pairs;
  PaintHooks hooks;
  hooks.stop = stop;
  hooks.picture = [&](Index i, const Image& drawn) {
    Image colors(drawn.width, drawn.height, 3);
    for (std::size_t p = 0; p < colors.data.size(); ++p) {
      colors.data[p] = drawn.data[4 * (p / 3) + p % 3];
    }
    pairs.push_back({views[static_cast<std::size_t>(i)].picture, "taken"});
    pairs.push_back({std::move(colors), "drawn"});
  };
  PaintOptions options;
  options.background = {0.6, 0.6, 0.6};
  if (!paint_scene(scene, options, device, hooks)) {
    return std::nullopt;
  }
  ContactSheetOptions sheet;
  sheet.columns = 6;
  sheet.cell_width = 300;
  return contact_sheet(pairs, sheet);
}

}  // namespace atelier
