#include "pipeline/pattern/flatten_files.h"

#include "core/io/image_file.h"
#include "core/io/mesh_obj.h"
#include "pipeline/pictures/flatten_pictures.h"
#include "registration/drafting/exchange_dxf.h"
#include "registration/drafting/garment_pattern_text.h"
#include "registration/drafting/pattern_pdf.h"
#include "registration/drafting/valentina_text.h"

namespace atelier {

std::vector<FlattenFile> flatten_files(const FlattenedGarment& flat, const std::string& title,
                                       const FlattenStageOptions& options, bool pictures) {
  std::vector<FlattenFile> files;
  const auto add = [&](const char* name, std::string bytes) {
    files.push_back({name, std::move(bytes)});
  };
  add("pattern.svg", pattern_svg(flat.layout, title));
  add("pattern.dxf", pattern_dxf(flat.layout, title));
  add("pattern_astm.dxf", exchange_dxf(flat.layout, title, DxfDialect::Astm));
  add("pattern_aama.dxf", exchange_dxf(flat.layout, title, DxfDialect::Aama));
  add("pattern.pdf", pattern_pdf(flat.layout, title));
  add("pattern.val", valentina_text(flat.draft, flat.layout, options.pattern, title));
  add("pattern.json", garment_pattern_text(flat.draft));
  add("garment.obj", obj_text(polygons_of(with_flat_uvs(flat))));
  if (flat.sewn) {
    add("sewn.obj", obj_text(polygons_of(flat.sewn->mesh)));
  }
  if (pictures) {
    add("stretch.png",
        image_bytes(stretch_picture(flat.mesh, flat.pattern, flat.measures, flat.facing),
                    ImageFormat::Png));
  }
  if (pictures && flat.sewn) {
    add("sewn.png", image_bytes(sewn_picture(flat.sewn->mesh, flat.sewn->captured, flat.sewn->body,
                                             flat.sewn->off, flat.sewn->turn * flat.facing),
                                ImageFormat::Png));
  }
  return files;
}

}  // namespace atelier
