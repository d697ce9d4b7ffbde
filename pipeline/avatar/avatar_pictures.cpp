#include "pipeline/avatar/avatar_pictures.h"

#include <memory>
#include <vector>

#include "bodymodel/formats/personal_body.h"
#include "core/io/image_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/framing.h"
#include "core/render/studio.h"
#include "pipeline/avatar/avatar_drawing.h"
#include "pipeline/pictures/animation_pictures.h"
#include "pipeline/pictures/report_drawings.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// At rest, from the front and the back: its shape, and its texture.
std::string rest_pictures(const fs::path& result) {
  RenderMesh mesh;
  mesh.mesh = read_personal_body(result / "avatar.npz").model.mesh;
  const AppearanceModel model = avatar_model_at(result / "body" / "model.safetensors");
  std::vector<CaptionedImage> images;
  for (const View& view : {kFront, kBack}) {
    mesh.look = clay_look();
    images.push_back({seen_in_report({mesh}, view, kReportWide), "shape"});
    mesh.look = textured_skin_look(std::make_shared<const Image>(model.static_texture));
    images.push_back({seen_in_report({mesh}, view, kReportWide), "mean texture"});
  }
  ContactSheetOptions sheet;
  sheet.columns = 4;
  return figure_html(contact_sheet(images, sheet),
                     "The body as it is seen, with hair and shoes, in its rest pose");
}

}  // namespace

std::string avatar_pictures(const StageStatus& own, const ReportPlaces& places) {
  const fs::path result = result_folder_of(own, places);
  std::string html = rest_pictures(result);
  if (const fs::path file = result / "pictures.png"; fs::exists(file)) {
    html += figure_html(linear_from_srgb(read_byte_image(file)),
                        "Images that the avatar was made from, as taken and as drawn");
  }
  if (const fs::path file = result / "crops.png"; fs::exists(file)) {
    html += figure_html(linear_from_srgb(read_byte_image(file)),
                        "Details of images that the avatar was made from, as taken and as drawn");
  }
  return html;
}

}  // namespace atelier
