#include "appearance/prepare.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/label.h"
#include "core/raster.h"
#include "core/tree.h"

namespace atelier {
namespace {

void require_size(const ByteImage& image, const Camera& camera, int channels, const char* what) {
  if (!image.data.empty() && (image.width != camera.width || image.height != camera.height ||
                              image.channels != channels)) {
    throw DataError("", std::string(what) + " of camera " + camera.id,
                    std::to_string(image.width) + " x " + std::to_string(image.height) +
                        " pixels of " + std::to_string(image.channels) + " channels",
                    std::to_string(camera.width) + " x " + std::to_string(camera.height) + " of " +
                        std::to_string(channels) + ", as calibrated");
  }
}

/// Whether all labels next to a pixel are the surface's. Label images are a pixel off at outlines:
/// what they call a garment there may be the wall behind it, and a texel that few images show
/// learns nothing else. Two pixels mend no more than one.
bool labelled_around(const ByteImage& labels, int pixel, int label) {
  constexpr int kOff = 1;  // px
  const int column = pixel % labels.width;
  const int line = pixel / labels.width;
  for (int y = std::max(line - kOff, 0); y <= std::min(line + kOff, labels.height - 1); ++y) {
    for (int x = std::max(column - kOff, 0); x <= std::min(column + kOff, labels.width - 1); ++x) {
      if (labels.at(x, y) != label) {
        return false;
      }
    }
  }
  return true;
}

AppearanceView view_of(const VisiblePixels& seen, const Camera& camera, const TakenPicture& taken,
                       const DrawnSurface& surface, LabelAgreement& agreement) {
  require_size(taken.colors, camera, 3, "picture");
  require_size(taken.labels, camera, 1, "label image");
  const bool labelled = surface.label >= 0 && !taken.labels.data.empty();
  AppearanceView view;
  for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
    if (surface.trusted_only && seen.trusted[i] == 0) {
      continue;
    }
    const auto place = static_cast<std::size_t>(seen.pixel[i]);
    if (labelled) {
      const bool agrees = taken.labels.data[place] == surface.label;
      if (!agrees && surface.hidden &&
          taken.labels.data[place] != static_cast<std::uint8_t>(Label::Background)) {
        continue;
      }
      ++agreement.judged;
      agreement.agreed += agrees ? 1 : 0;
      if (!agrees || !labelled_around(taken.labels, seen.pixel[i], surface.label)) {
        continue;
      }
    }
    view.pixel.push_back(seen.pixel[i]);
    view.u.push_back(std::clamp(seen.u[i], 0.0F, 1.0F));
    view.v.push_back(std::clamp(seen.v[i], 0.0F, 1.0F));
    if (!taken.colors.data.empty()) {
      const auto first = taken.colors.data.begin() + 3 * static_cast<std::ptrdiff_t>(place);
      view.colors.insert(view.colors.end(), first, first + 3);
    }
  }
  return view;
}

/// @param pixels  that are learnt from
/// @param seen    pixels of the surface, before any is left out
/// @param pictures  that there were to look at
void require_agreement(const std::string& name, int fewest, std::size_t pixels, std::size_t seen,
                       std::size_t pictures, const std::vector<LabelAgreement>& agreement) {
  LabelAgreement all;
  for (const LabelAgreement& one : agreement) {
    all.judged += one.judged;
    all.agreed += one.agreed;
  }
  if (all.judged > 0 && 2 * all.agreed < all.judged) {
    throw DataError("", "images of " + name,
                    "label images give it " + std::to_string(all.agreed) + " of the " +
                        std::to_string(all.judged) + " pixels where the geometry has it",
                    "images, calibration and geometry of one capture");
  }
  if (pixels < static_cast<std::size_t>(fewest)) {
    if (pictures == 0) {
      throw DataError("", "images of " + name, "none at all",
                      "images of the frames in which it is worn");
    }
    const std::string count = std::to_string(pixels);
    if (seen >= static_cast<std::size_t>(fewest)) {
      throw DataError("", "images of " + name,
                      count + " of " + std::to_string(seen) +
                          " pixels that show it are left, away from outlines and other labels",
                      "less --visible.erosion, larger images, or labels of this garment");
    }
    throw DataError("", "images of " + name, count + " pixels show it",
                    "cameras that see it, with the calibration that belongs to them");
  }
}

}  // namespace

OptionTable describe(PrepareAppearanceOptions& options) {
  OptionTable table;
  table.add("occlusion", describe(options.occlusion));
  table.add("visible", describe(options.visible));
  return table;
}

AppearanceData prepare_appearance(const DressedSubject& subject, const DrawnSurface& surface,
                                  const TakenPictures& pictures,
                                  const PrepareAppearanceOptions& options, Device device,
                                  std::vector<LabelAgreement>* agreement) {
  const auto& [cameras, frame_ids, read] = pictures;
  ATELIER_CHECK(
      surface.which < subject.faces.size() && subject.faces.size() == subject.names.size(),
      "the surface to draw is one of the subject's");
  AppearanceData data;
  data.name = subject.names[surface.which];
  data.faces = subject.faces[surface.which];
  data.uvs = surface.atlas.uvs;
  data.uv_faces = surface.atlas.uv_faces;
  data.occlusion = options.occlusion;
  data.centers.resize(static_cast<Index>(cameras.size()), 3);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    data.camera_ids.push_back(cameras[c].id);
    data.centers.row(static_cast<Index>(c)) = camera_center(cameras[c]);
    data.widths.push_back(cameras[c].width);
    data.heights.push_back(cameras[c].height);
  }
  std::size_t pixels = 0;
  std::size_t all_pixels = 0;
  std::size_t looked_at = 0;
  std::vector<LabelAgreement> agreements(cameras.size());
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
    const JoinedSurfaces all = joined_surfaces(surfaces);
    SurfaceFrame frame = surface_frame(own, data.faces, data.uvs, data.uv_faces, frame_id);
    frame.transfer =
        light_transfer(frame, build_tree(all.vertices, all.faces), options.occlusion, device);
    if (subject.face && surface.which == 0) {
      frame.face = subject.face(frame_id);
    }
    data.frames.push_back(std::move(frame));
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const TakenPicture taken = read ? read(c, frame_id) : TakenPicture();
      if (read && taken.colors.data.empty()) {
        continue;
      }
      ++looked_at;
      const Raster raster = rasterize(all.vertices, all.faces, cameras[c], {}, device);
      const VisiblePixels seen =
          visible_pixels(raster, all.first_face[which], data.uvs, data.uv_faces, options.visible);
      all_pixels += seen.pixel.size();
      AppearanceView view = view_of(seen, cameras[c], taken, surface, agreements[c]);
      view.camera_idx = static_cast<int>(c);
      view.frame_idx = static_cast<int>(data.frames.size()) - 1;
      pixels += view.pixel.size();
      if (!view.pixel.empty()) {
        data.views.push_back(std::move(view));
      }
    }
  }
  require_agreement(data.name, surface.fewest_pixels, pixels, all_pixels, looked_at, agreements);
  if (agreement != nullptr) {
    *agreement = std::move(agreements);
  }
  return data;
}

}  // namespace atelier
