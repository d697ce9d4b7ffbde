#include "pipeline/pictures/flatten_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/render/color_map.h"
#include "core/render/contact_sheet.h"
#include "core/render/drawing.h"
#include "core/render/studio.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "pipeline/pictures/named_views.h"
#include "registration/flattening/front_and_back.h"

namespace atelier {
namespace {

constexpr double kMaxShown = 0.06;  // strain at the end of the colour map
constexpr int kSheetHeight = 640;

/// The panels side by side, filled with the colours of their triangles, seams drawn over them.
Image flat_picture(const Garment& garment, const Colors& colors) {
  constexpr int kMargin = 12;
  const Eigen::RowVector2d low = garment.rest.colwise().minCoeff();
  const Eigen::RowVector2d high = garment.rest.colwise().maxCoeff();
  const double scale = std::min((kSheetHeight - 2.0 * kMargin) / (high.y() - low.y()),
                                (1000 - 2.0 * kMargin) / (high.x() - low.x()));
  const int width =
      std::max(64, saturating_cast<int>(std::ceil((high.x() - low.x()) * scale) + 2 * kMargin));
  const int height =
      std::max(64, saturating_cast<int>(std::ceil((high.y() - low.y()) * scale) + 2 * kMargin));
  Image picture(width, height, 3, 1.0F);
  const auto pixel = [&](int v) {
    return Eigen::Vector2d((garment.rest(v, 0) - low.x()) * scale + kMargin,
                           height - kMargin - (garment.rest(v, 1) - low.y()) * scale);
  };
  for (Index f = 0; f < garment.rest_faces.rows(); ++f) {
    const Eigen::Vector2d a = pixel(garment.rest_faces(f, 0));
    const Eigen::Vector2d b = pixel(garment.rest_faces(f, 1));
    const Eigen::Vector2d c = pixel(garment.rest_faces(f, 2));
    const auto side = [](const Eigen::Vector2d& from, const Eigen::Vector2d& to, double x,
                         double y) {
      return (to.x() - from.x()) * (y - from.y()) - (to.y() - from.y()) * (x - from.x());
    };
    const auto first_x = saturating_cast<int>(std::min({a.x(), b.x(), c.x()}));
    const auto first_y = saturating_cast<int>(std::min({a.y(), b.y(), c.y()}));
    for (int y = std::max(0, first_y); y <= std::max({a.y(), b.y(), c.y()}) && y < height; ++y) {
      for (int x = std::max(0, first_x); x <= std::max({a.x(), b.x(), c.x()}) && x < width; ++x) {
        const double px = x + 0.5;
        const double py = y + 0.5;
        if (side(a, b, px, py) <= 0 && side(b, c, px, py) <= 0 && side(c, a, px, py) <= 0) {
          for (int channel = 0; channel < 3; ++channel) {
            picture.at(x, y, channel) = colors(f, channel);
          }
        }
      }
    }
  }
  std::vector<Mark> marks;
  const Topology topology = topology_of(garment.rest_faces, garment.rest.rows());
  for (const std::vector<int>& loop : boundary_loops(topology)) {
    Polyline line;
    line.closed = true;
    line.color = {0, 0, 0};
    for (const int v : loop) {
      line.points.push_back(pixel(v));
    }
    marks.emplace_back(std::move(line));
  }
  return drawn(picture, marks);
}

}  // namespace

Image stretch_picture(const Mesh& mesh, const FlatPattern& pattern, const FlatMeasures& measures,
                      const Eigen::Vector3d& facing) {
  const Colors colors = map_colors(ColorMap::Viridis, measures.strain, 0, kMaxShown);
  // A vertex for each panel's corner, so that colours and seams do not blur into each other.
  Mesh shown;
  shown.vertices.resize(3 * mesh.faces.rows(), 3);
  shown.faces.resize(mesh.faces.rows(), 3);
  shown.colors.resize(3 * mesh.faces.rows(), 3);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      shown.vertices.row(3 * f + k) = mesh.vertices.row(mesh.faces(f, k));
      shown.colors.row(3 * f + k) = colors.row(f);
      shown.faces(f, k) = static_cast<int>(3 * f + k);
    }
  }
  PictureOptions options;
  options.width = 360;
  options.height = kSheetHeight;
  options.samples = 4;
  char caption[120];
  std::snprintf(caption, sizeof caption, "stretch p50 %.2f%%, p99 %.2f%%",
                100 * measures.strain_p50, 100 * measures.strain_p99);
  const auto [front, back] = two_sides(facing, facing_of(mesh));
  // One row each, so that narrow images do not stand in cells as wide as the widest.
  const Image flat = flat_picture(garment_of(mesh, pattern), colors);
  const Image views =
      contact_sheet({{picture_of(shown, front.view, options), front.name},
                     {picture_of(shown, back.view, options), back.name},
                     {color_bar(ColorMap::Viridis, 0, kMaxShown, "stretch", kSheetHeight), ""}},
                    {.columns = 3});
  return contact_sheet({{views, ""}, {flat, caption}},
                       {.columns = 1, .even_rows = false, .title = "Stretch of the flat panels"});
}

Image sewn_picture(const Mesh& sewn, const Mesh& captured, const Mesh& body,
                   const Eigen::VectorXd& off, const Eigen::Vector3d& facing) {
  constexpr double kMaxOff = 0.03;  // m at the end of the colour map
  PictureOptions options;
  options.width = 360;
  options.height = kSheetHeight;
  options.samples = 4;
  RenderMesh skin{body, clay_look()};
  skin.mesh.colors.resize(0, 3);
  skin.mesh.normals.resize(0, 3);  // those of a file may be of another pose
  RenderMesh cloth{sewn, clay_look()};
  cloth.mesh.normals.resize(0, 3);
  cloth.mesh.colors = map_colors(ColorMap::Viridis, off, 0, kMaxOff);
  cloth.look.color = {1, 1, 1};  // times the colours
  RenderMesh worn{captured, clay_look()};
  worn.mesh.colors.resize(0, 3);
  worn.mesh.normals.resize(0, 3);
  worn.look.color = {0.16F, 0.24F, 0.42F};
  std::vector<CaptionedImage> cells;
  for (const NamedView& side : two_sides(facing, facing_of(captured))) {
    cells.push_back({picture_of({skin, worn}, side.view, options), "captured, " + side.name});
    cells.push_back({picture_of({skin, cloth}, side.view, options), "sewn anew, " + side.name});
  }
  cells.push_back({color_bar(ColorMap::Viridis, 0, 1000 * kMaxOff, "mm", kSheetHeight), ""});
  return contact_sheet(cells, {.columns = 5, .title = "The written pattern, sewn and draped"});
}

}  // namespace atelier
