#include "appearance/shown_surfaces.h"

#include <algorithm>

#include "appearance/shown_surfaces_backend.h"
#include "appearance/surface_frame.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/raster.h"

namespace atelier {
namespace {

class CpuShownSurfaces : public ShownSurfaces {
 public:
  CpuShownSurfaces(std::vector<ShownSurface> surfaces, const PaintOptions& options)
      : surfaces_(std::move(surfaces)),
        options_(options),
        faces_(faces_of_all(surfaces_)),
        frames_(surfaces_.size()) {
    for (const ShownSurface& surface : surfaces_) {
      uvs_.emplace_back(surface.uvs.cast<float>());
    }
  }

  std::vector<bool> look(const Points& vertices, const Camera& camera) override {
    require_shown_vertices(surfaces_, vertices);
    vertices_ = vertices;
    eye_ = camera_center(camera);
    tree_ = has_tree_ ? refit_tree(std::move(tree_), vertices_) : build_tree(vertices_, faces_);
    has_tree_ = true;
    raster_ = rasterize(vertices_, faces_, camera);
    std::vector<bool> seen(surfaces_.size(), false);
    std::size_t last = 0;  // faces of neighbours are mostly of one surface
    std::vector<Index> end = {0};
    for (const ShownSurface& surface : surfaces_) {
      end.push_back(end.back() + surface.faces.rows());
    }
    for (const int face : raster_.face.data) {
      if (face < 0) {
        continue;
      }
      while (face >= end[last + 1]) {
        ++last;
      }
      while (face < end[last]) {
        --last;
      }
      seen[last] = true;
    }
    return seen;
  }

  SurfaceArrays surface(std::size_t which) override {
    ATELIER_CHECK(which < surfaces_.size(), "a surface that was not given");
    const ShownSurface& own = surfaces_[which];
    Index first = 0;
    for (std::size_t s = 0; s < which; ++s) {
      first += surfaces_[s].vertices;
    }
    SurfaceFrame& frame = frames_[which];
    frame =
        surface_frame(vertices_.middleRows(first, own.vertices), own.faces, own.uvs, own.uv_faces);
    frame.transfer = light_transfer(frame, tree_, options_.occlusion);
    return {frame.position.data(), frame.normal.data(), frame.tangent.data(),
            frame.transfer.data(), own.vertices,        own.uvs.rows()};
  }

  Image picture(const std::vector<SurfaceLook>& looks) override {
    std::vector<PictureLayer> layers = picture_layers(surfaces_, looks);
    for (std::size_t s = 0; s < layers.size(); ++s) {
      layers[s].faces = surfaces_[s].faces.data();
      layers[s].uv_faces = surfaces_[s].uv_faces.data();
      layers[s].uvs = uvs_[s].data();
      layers[s].position = frames_[s].position.data();
      layers[s].transfer = frames_[s].transfer.data();
    }
    const PictureStyle style = picture_style(options_, eye_);
    Image picture(raster_.face.width / style.samples, raster_.face.height / style.samples, 4);
    const RasterView raster{raster_.face.data.data(), raster_.barycentric.data.data(),
                            raster_.face.width};
    constexpr Index kRows = 16;
    parallel_for(picture.height, kRows, [&](Index begin, Index end) {
      for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
        for (int x = 0; x < picture.width; ++x) {
          const PictureColor color =
              picture_color(layers.data(), static_cast<int>(layers.size()), raster, x, y, style);
          std::copy(std::begin(color.channel), std::end(color.channel), &picture.at(x, y));
        }
      }
    });
    return picture;
  }

  void wait() const override {}

 private:
  std::vector<ShownSurface> surfaces_;
  PaintOptions options_;
  Triangles faces_;  // of all
  std::vector<Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor>> uvs_;
  Points vertices_;
  Eigen::Vector3d eye_ = Eigen::Vector3d::Zero();
  TriangleTree tree_;
  bool has_tree_ = false;
  Raster raster_;
  std::vector<SurfaceFrame> frames_;
};

}  // namespace

Triangles faces_of_all(const std::vector<ShownSurface>& surfaces) {
  Index count = 0;
  for (const ShownSurface& surface : surfaces) {
    count += surface.faces.rows();
  }
  Triangles all(count, 3);
  Index vertex = 0;
  Index face = 0;
  for (const ShownSurface& surface : surfaces) {
    all.middleRows(face, surface.faces.rows()) = surface.faces.array() + static_cast<int>(vertex);
    vertex += surface.vertices;
    face += surface.faces.rows();
  }
  return all;
}

void require_shown_vertices(const std::vector<ShownSurface>& surfaces, const Points& vertices) {
  Index count = 0;
  for (const ShownSurface& surface : surfaces) {
    count += surface.vertices;
  }
  ATELIER_CHECK(vertices.rows() == count, "a look takes the vertices of all surfaces");
}

std::vector<PictureLayer> picture_layers(const std::vector<ShownSurface>& surfaces,
                                         const std::vector<SurfaceLook>& looks) {
  ATELIER_CHECK(looks.size() == surfaces.size(), "an image takes a look for each surface");
  std::vector<PictureLayer> layers;
  int face = 0;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    ATELIER_CHECK(looks[s].texture == nullptr || looks[s].resolution >= 2,
                  "a texture has 2 or more texels a side");
    PictureLayer layer = {};
    layer.first_face = face;
    face += static_cast<int>(surfaces[s].faces.rows());
    layer.end_face = face;
    layer.texture = looks[s].texture;
    layer.resolution = looks[s].resolution;
    std::copy(looks[s].color.begin(), looks[s].color.end(), layer.color);
    layers.push_back(layer);
  }
  return layers;
}

PictureStyle picture_style(const PaintOptions& options, const Eigen::Vector3d& eye) {
  PictureStyle style = {options.samples, options.alpha, {}, {}};
  std::copy(options.background.begin(), options.background.end(), style.background);
  for (Index i = 0; i < 3; ++i) {
    style.eye[i] = static_cast<float>(eye[i]);
  }
  return style;
}

std::unique_ptr<ShownSurfaces> make_shown_surfaces(std::vector<ShownSurface> surfaces,
                                                   const PaintOptions& asked, Device device) {
  PaintOptions options = asked;
  options.occlusion = drawn_occlusion(asked.occlusion, {});
  ATELIER_CHECK(options.samples >= 1 && options.samples <= 8 && options.background.size() == 3 &&
                    options.occlusion.strata <= 32 && options.occlusion.reach <= 100 &&
                    options.occlusion.offset <= 0.1,
                "options of painting are out of range");
  for (ShownSurface& surface : surfaces) {
    if (surface.uvs.rows() == 0) {
      surface.uvs = Points2::Zero(1, 2);
      surface.uv_faces = Triangles::Zero(surface.faces.rows(), 3);
    }
    const auto named = [](const Triangles& corners, Index count) {
      return corners.rows() == 0 || (corners.minCoeff() >= 0 && corners.maxCoeff() < count);
    };
    ATELIER_CHECK(surface.faces.rows() == surface.uv_faces.rows(),
                  "faces and texture faces differ in number");
    ATELIER_CHECK(named(surface.faces, surface.vertices),
                  "a face names a vertex that is not there");
    ATELIER_CHECK(named(surface.uv_faces, surface.uvs.rows()),
                  "a texture face names a coordinate that is not there");
  }
  check_device(device);
#ifdef ATELIER_HAS_CUDA
  if (device == Device::Cuda) {
    return make_cuda_shown_surfaces(std::move(surfaces), options);
  }
#endif
  return std::make_unique<CpuShownSurfaces>(std::move(surfaces), options);
}

}  // namespace atelier
