#include "pipeline/cloth/material_grid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "capture/frame_reader.h"
#include "capture/stereo/undistort.h"
#include "core/render/contact_sheet.h"
#include "core/render/tone.h"
#include "core/saturating_cast.h"
#include "core/tree.h"
#include "pipeline/pictures/animation_pictures.h"
#include "simulation/files/material_file.h"

namespace atelier {
namespace {

constexpr int kCellWidth = 220;
constexpr int kMaxCellHeight = 330;

/// The registered garments in the last frame that is compared, one behind the other.
std::vector<Mesh> registered_garments(const Trials& trials) {
  std::vector<Mesh> meshes;
  for (const TrialGarment& garment : trials.garments) {
    Mesh mesh;
    mesh.vertices = garment.targets.back();
    mesh.faces = garment.worn.garment.mesh.faces;
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

/// px2 of the garments' triangles that the camera sees in its image.
double shown_area(const Camera& camera, const std::vector<Mesh>& garments,
                  const TriangleTree& body) {
  const Eigen::Vector3d eye = camera_center(camera);
  double area = 0;
  for (const Mesh& mesh : garments) {
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      const auto corner = [&](int k) -> Eigen::Vector3d {
        return mesh.vertices.row(mesh.faces(f, k)).transpose();
      };
      const auto a = project(camera, corner(0));
      const auto b = project(camera, corner(1));
      const auto c = project(camera, corner(2));
      const auto inside = [&](const auto& pixel) {
        return pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < camera.width &&
               pixel->y() < camera.height;
      };
      if (!inside(a) || !inside(b) || !inside(c)) {
        continue;
      }
      // Counter-clockwise from outside, with rows that grow downwards: negative in the image.
      const Eigen::Vector2d u = *b - *a;
      const Eigen::Vector2d v = *c - *a;
      const double signed_area = (u.x() * v.y() - u.y() * v.x()) / 2;
      const Eigen::Vector3d ray = (corner(0) + corner(1) + corner(2)) / 3 - eye;
      if (signed_area < 0 && first_hit(body, {eye, ray, 0, 0.99}).face < 0) {
        area -= signed_area;
      }
    }
  }
  return area;
}

/// The camera's image cut to a rectangle and scaled to the cells' size.
Camera cut(const Camera& camera, int left, int top, int width, int height, double scale) {
  Camera small = camera;
  small.width = std::max(1, saturating_cast<int>(std::round(width * scale)));
  small.height = std::max(1, saturating_cast<int>(std::round(height * scale)));
  const double across = static_cast<double>(small.width) / width;
  const double down = static_cast<double>(small.height) / height;
  small.fx *= across;
  small.fy *= down;
  small.cx = (camera.cx - left) * across;
  small.cy = (camera.cy - top) * down;
  return small;
}

/// Rows and columns of the garments in the image, with a tenth to spare.
std::optional<Eigen::AlignedBox2i> garments_box(const Camera& camera,
                                                const std::vector<Mesh>& garments) {
  Eigen::AlignedBox2d box;
  for (const Mesh& mesh : garments) {
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      if (const auto pixel = project(camera, mesh.vertices.row(v).transpose())) {
        box.extend(*pixel);
      }
    }
  }
  if (box.isEmpty()) {
    return std::nullopt;
  }
  const Eigen::Vector2d spare = 0.1 * box.sizes();
  const Eigen::Vector2d size(camera.width, camera.height);
  const Eigen::Vector2d low = (box.min() - spare).cwiseMax(0).cwiseMin(size);
  const Eigen::Vector2d high = (box.max() + spare).cwiseMax(0).cwiseMin(size);
  const Eigen::AlignedBox2i pixels(low.cast<int>(), high.array().ceil().matrix().cast<int>());
  constexpr int kLeast = 8;  // px across which something can be seen
  return pixels.sizes().minCoeff() < kLeast ? std::nullopt : std::optional(pixels);
}

Image cut(const Image& image, const Eigen::AlignedBox2i& box) {
  Image part(box.sizes().x(), box.sizes().y(), 3);
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        part.at(x, y, c) =
            image.at(box.min().x() + x, box.min().y() + y, image.channels == 1 ? 0 : c);
      }
    }
  }
  return part;
}

}  // namespace

std::optional<TakenGarments> taken_garments(const Dataset& dataset, const Trials& trials) {
  if (!dataset.calibrated) {
    return std::nullopt;
  }
  const int frame_id = trials.frame_ids.back();
  const std::vector<Mesh> garments = registered_garments(trials);
  const TriangleTree body =
      build_tree(trials.bodies[static_cast<std::size_t>(trials.steps.back())], trials.body_faces);
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  double most = 0;
  std::size_t best = dataset.cameras.size();
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    if (!dataset.frames[c].images.contains(frame_id) ||
        std::find(held.begin(), held.end(), camera.id) != held.end()) {
      continue;
    }
    const double area = shown_area(without_distortion(camera), garments, body);
    if (area > most) {
      most = area;
      best = c;
    }
  }
  if (best == dataset.cameras.size()) {
    return std::nullopt;
  }
  const Camera& camera = dataset.cameras[best];
  const Camera straight = without_distortion(camera);
  const auto box = garments_box(straight, garments);
  FrameReader reader(dataset);
  const std::optional<Image> image = reader.image(static_cast<Index>(best), frame_id);
  if (!box || !image || image->width != camera.width || image->height != camera.height) {
    return std::nullopt;
  }
  const int width = box->sizes().x();
  const int height = box->sizes().y();
  const double scale = std::min(static_cast<double>(kCellWidth) / width,
                                static_cast<double>(kMaxCellHeight) / height);
  TakenGarments taken;
  taken.camera = cut(straight, box->min().x(), box->min().y(), width, height, scale);
  taken.picture =
      resized(cut(undistorted(camera, *image), *box), taken.camera.width, taken.camera.height);
  taken.caption = "taken by camera " + camera.id + "\nframe " + std::to_string(frame_id);
  return taken;
}

Image material_grid(const Trials& trials, const std::vector<std::vector<Stiffness>>& scenes,
                    const std::vector<SceneResult>& results, int columns,
                    const std::optional<TakenGarments>& taken) {
  Mesh body;
  body.vertices = trials.bodies[static_cast<std::size_t>(trials.steps.back())];
  body.faces = trials.body_faces;
  const PictureOptions picture{.width = 200, .height = 300, .samples = 4, .framing = {}};
  const auto seen = [&](const std::vector<RenderMesh>& meshes) {
    if (!taken) {
      return picture_of(meshes, kThreeQuarter, picture);
    }
    const Eigen::Vector3d from =
        camera_center(taken->camera) - body.vertices.colwise().mean().transpose();
    return tone_mapped(render(studio_scene(meshes, std::atan2(from.x(), from.z())), taken->camera,
                              {.samples = picture.samples, .ambient_samples = 4}),
                       {.dither = 1});
  };
  std::vector<CaptionedImage> pictures;
  for (std::size_t n = 0; n < scenes.size(); ++n) {
    if (taken && n % static_cast<std::size_t>(columns) == 0) {
      pictures.push_back({taken->picture, taken->caption});
    }
    std::vector<RenderMesh> meshes = {{body, skin_look()}};
    Index first = 0;
    double distance = 0;
    for (std::size_t g = 0; g < trials.garments.size() && results[n].end.rows() > 0; ++g) {
      Mesh mesh = trials.garments[g].worn.garment.mesh;
      mesh.vertices = results[n].end.middleRows(first, mesh.vertices.rows());
      mesh.normals.resize(0, 3);
      first += mesh.vertices.rows();
      distance += results[n].distances[g] / static_cast<double>(trials.garments.size());
      meshes.push_back({std::move(mesh), cloth_look(g)});
    }
    pictures.push_back(
        {seen(meshes), number_text(scenes[n][0].stretch) + " N/m, " +
                           number_text(scenes[n][0].bending) + " N m\n" +
                           (results[n].end.rows() > 0 ? number_text(1e3 * distance) + " mm"
                                                      : "the simulation broke")});
  }
  ContactSheetOptions sheet;
  sheet.columns = columns + (taken ? 1 : 0);
  sheet.text_height = 8;
  sheet.title = taken ? "Stretching over columns, bending over rows, beside the capture's picture"
                      : "Stretching over columns, bending over rows";
  return contact_sheet(pictures, sheet);
}

}  // namespace atelier
