#include "pipeline/pictures/template_pictures.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/render/contact_sheet.h"
#include "core/render/drawing.h"
#include "core/render/studio.h"
#include "core/topology.h"
#include "pipeline/pictures/named_views.h"
#include "pipeline/pictures/ring_tube.h"

namespace atelier {
namespace {

constexpr int kPicture = 520;

const std::array<Eigen::Vector3f, 6> kRingColors = {{{0.8F, 0.05F, 0.05F},
                                                     {0.05F, 0.25F, 0.8F},
                                                     {0.05F, 0.5F, 0.1F},
                                                     {0.8F, 0.45F, 0.02F},
                                                     {0.5F, 0.05F, 0.6F},
                                                     {0.02F, 0.5F, 0.55F}}};

/// Outlines of the charts in the unit square.
Image charts_picture(const Mesh& mesh) {
  constexpr int kMargin = 10;
  const Image paper(kPicture, kPicture, 3, 1.0F);
  std::vector<Mark> marks;
  for (const std::vector<int>& loop : boundary_loops(topology_of(mesh.uv_faces, mesh.uvs.rows()))) {
    Polyline line;
    line.closed = true;
    line.color = {0.1F, 0.2F, 0.4F};
    for (const int v : loop) {
      line.points.emplace_back(kMargin + mesh.uvs(v, 0) * (kPicture - 2 * kMargin),
                               kPicture - kMargin - mesh.uvs(v, 1) * (kPicture - 2 * kMargin));
    }
    marks.emplace_back(std::move(line));
  }
  return drawn(paper, marks);
}

}  // namespace

Image template_picture(const std::vector<GarmentTemplate>& made, const ClothedFrames& frames) {
  std::vector<Image> rows;
  std::vector<std::string> captions;
  for (const GarmentTemplate& one : made) {
    const auto at = std::find(frames.frame_ids.begin(), frames.frame_ids.end(), one.frame_id);
    RenderMesh body;
    body.mesh.vertices = frames.load(at - frames.frame_ids.begin()).body;
    body.mesh.faces = frames.body_faces;
    body.look.color = {0.62F, 0.45F, 0.36F};
    RenderMesh cloth{one.garment.mesh, clay_look()};
    cloth.mesh.normals.resize(0, 3);
    cloth.mesh.colors.resize(cloth.mesh.vertices.rows(), 3);
    for (Index v = 0; v < cloth.mesh.vertices.rows(); ++v) {
      const bool free = one.dynamic[static_cast<std::size_t>(v)] != 0;
      cloth.mesh.colors.row(v) =
          free ? Eigen::RowVector3f(0.55F, 0.62F, 0.8F) : Eigen::RowVector3f(1, 1, 1);
    }
    cloth.look.edge_color = Eigen::Vector3f(0.1F, 0.1F, 0.1F);
    cloth.look.edge_width = 0.7F;
    std::vector<RenderMesh> scene = {body, cloth};
    std::string caption = one.garment.name + ", frame " + std::to_string(one.frame_id) + ":";
    for (std::size_t b = 0; b < one.garment.boundaries.size(); ++b) {
      RenderMesh ring{ring_tube(one.garment.mesh.vertices, one.garment.boundaries[b]), {}};
      ring.look.color = kRingColors[b % kRingColors.size()];
      scene.push_back(std::move(ring));
      caption += (b == 0 ? " " : ", ") + one.garment.boundary_names[b];
    }
    PictureOptions options;
    options.width = 400;
    options.height = kPicture;
    options.samples = 6;
    const auto [front, back] = two_sides(one.facing);
    const bool known = !one.facing.isZero();
    rows.push_back(contact_sheet(
        {{picture_of(scene, front.view, options), front.name},
         {picture_of(scene, turned(kSide, one.facing), options), known ? "left" : "from +X"},
         {picture_of(scene, back.view, options), back.name},
         {charts_picture(one.garment.mesh), "charts"}},
        {.columns = 4}));
    captions.push_back(caption);
  }
  std::vector<CaptionedImage> sheet;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sheet.push_back({rows[i], captions[i]});
  }
  return contact_sheet(sheet, {.columns = 1, .title = "Garment templates"});
}

}  // namespace atelier
