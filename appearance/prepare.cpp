#include "appearance/prepare.h"

#include "core/error.h"
#include "core/tree.h"

namespace atelier {
namespace {

/// All surfaces of an instant in one tree.
TriangleTree tree_of(const std::vector<Surface>& surfaces) {
  Index vertex_count = 0;
  Index face_count = 0;
  for (const Surface& surface : surfaces) {
    vertex_count += surface.vertices->rows();
    face_count += surface.faces->rows();
  }
  Points vertices(vertex_count, 3);
  Triangles faces(face_count, 3);
  Index v = 0;
  Index f = 0;
  for (const Surface& surface : surfaces) {
    vertices.middleRows(v, surface.vertices->rows()) = *surface.vertices;
    faces.middleRows(f, surface.faces->rows()) = surface.faces->array() + static_cast<int>(v);
    v += surface.vertices->rows();
    f += surface.faces->rows();
  }
  return build_tree(vertices, faces);
}

AppearanceView view_of(const VisiblePixels& seen, const Camera& camera, const ByteImage& picture,
                       bool trusted_only) {
  if (!picture.data.empty() &&
      (picture.width != camera.width || picture.height != camera.height || picture.channels != 3)) {
    throw DataError("", "picture of camera " + camera.id,
                    std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                        " pixels of " + std::to_string(picture.channels) + " channels",
                    std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                        " of 3, as calibrated");
  }
  AppearanceView view;
  for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
    if (trusted_only && seen.trusted[i] == 0) {
      continue;
    }
    view.pixel.push_back(seen.pixel[i]);
    view.u.push_back(std::min(std::max(seen.u[i], 0.0F), 1.0F));
    view.v.push_back(std::min(std::max(seen.v[i], 0.0F), 1.0F));
    if (!picture.data.empty()) {
      const auto first = picture.data.begin() + 3 * static_cast<std::ptrdiff_t>(seen.pixel[i]);
      view.colors.insert(view.colors.end(), first, first + 3);
    }
  }
  return view;
}

}  // namespace

OptionTable describe(PrepareAppearanceOptions& options) {
  OptionTable table;
  table.add("occlusion", describe(options.occlusion));
  table.add("visible", describe(options.visible));
  return table;
}

AppearanceData prepare_appearance(const DressedSubject& subject, const DrawnSurface& surface,
                                  const std::vector<Camera>& cameras,
                                  const std::vector<int>& frame_ids, const ReadPicture& read,
                                  const PrepareAppearanceOptions& options, Device device) {
  ATELIER_CHECK(
      surface.which < subject.faces.size() && subject.faces.size() == subject.names.size(),
      "the surface to draw is one of the subject's");
  AppearanceData data;
  data.name = subject.names[surface.which];
  data.faces = subject.faces[surface.which];
  data.uvs = surface.atlas.uvs;
  data.uv_faces = surface.atlas.uv_faces;
  data.resolution = surface.resolution;
  data.shadow_resolution = surface.shadow_resolution;
  data.centers.resize(static_cast<Index>(cameras.size()), 3);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    data.camera_ids.push_back(cameras[c].id);
    data.centers.row(static_cast<Index>(c)) = camera_center(cameras[c]);
    data.widths.push_back(cameras[c].width);
    data.heights.push_back(cameras[c].height);
  }
  const TexelMap texels = texture_texels(data);
  const TexelMap shadow = shadow_texels(data);
  std::size_t pixels = 0;
  for (const int frame_id : frame_ids) {
    const std::vector<Points> vertices = subject.load(frame_id);
    ATELIER_CHECK(vertices.size() == subject.faces.size(), "a frame has every surface");
    const Points& own = vertices[surface.which];
    if (own.rows() == 0) {
      throw DataError("", "frame " + std::to_string(frame_id), "no " + data.name,
                      "frames in which it is worn");
    }
    std::vector<Surface> surfaces;
    std::size_t which = 0;
    for (std::size_t s = 0; s < vertices.size(); ++s) {
      if (vertices[s].rows() > 0) {
        which = s == surface.which ? surfaces.size() : which;
        surfaces.push_back({&vertices[s], &subject.faces[s]});
      }
    }
    FrameMaps frame;
    frame.frame_id = frame_id;
    frame.geometry = geometry_maps(own, data.faces, data.uvs, data.uv_faces, texels);
    frame.visibility =
        ambient_visibility(geometry_maps(own, data.faces, data.uvs, data.uv_faces, shadow),
                           tree_of(surfaces), options.occlusion, device);
    data.frames.push_back(std::move(frame));
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const ByteImage picture = read ? read(c, frame_id) : ByteImage();
      if (read && picture.data.empty()) {
        continue;
      }
      AppearanceView view = view_of(visible_pixels(surfaces, which, data.uvs, data.uv_faces,
                                                   cameras[c], options.visible, device),
                                    cameras[c], picture, surface.trusted_only);
      view.camera_idx = static_cast<int>(c);
      view.frame_idx = static_cast<int>(data.frames.size()) - 1;
      pixels += view.pixel.size();
      if (!view.pixel.empty()) {
        data.views.push_back(std::move(view));
      }
    }
  }
  constexpr std::size_t kFewest = 100;
  if (pixels < kFewest) {
    throw DataError("", "pictures of " + data.name, std::to_string(pixels) + " pixels show it",
                    "cameras that see it, with the calibration that belongs to them");
  }
  return data;
}

}  // namespace atelier
