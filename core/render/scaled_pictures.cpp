#include "core/render/scaled_pictures.h"

#include <limits>
#include <utility>

#include "core/error.h"
#include "core/render/tone.h"

namespace atelier {

std::vector<Image> pictures_at_one_scale(std::vector<std::vector<RenderMesh>> subjects,
                                         const View& view, const PictureOptions& options) {
  ATELIER_CHECK(!subjects.empty(), "images at one scale need a subject");
  Points seen(0, 3);
  for (std::vector<RenderMesh>& subject : subjects) {
    Eigen::RowVector3d low = Eigen::RowVector3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::RowVector3d high = -low;
    for (const RenderMesh& one : subject) {
      low = low.cwiseMin(one.mesh.vertices.colwise().minCoeff());
      high = high.cwiseMax(one.mesh.vertices.colwise().maxCoeff());
    }
    const Eigen::RowVector3d middle(0.5 * (low.x() + high.x()), 0, 0.5 * (low.z() + high.z()));
    for (RenderMesh& one : subject) {
      one.mesh.vertices.rowwise() -= middle;
      const Index rows = seen.rows();
      seen.conservativeResize(rows + one.mesh.vertices.rows(), 3);
      seen.bottomRows(one.mesh.vertices.rows()) = one.mesh.vertices;
    }
  }
  const Camera camera = camera_around(seen, view, options.width, options.height, options.framing);
  RenderOptions render_options;
  render_options.samples = options.samples;
  render_options.ambient_samples = 4;
  std::vector<Image> pictures;
  pictures.reserve(subjects.size());
  for (std::vector<RenderMesh>& subject : subjects) {
    pictures.push_back(
        tone_mapped(render(studio_scene(std::move(subject), view.azimuth), camera, render_options),
                    {.dither = 1}));
  }
  return pictures;
}

std::vector<Image> pictures_at_one_scale(const std::vector<Mesh>& meshes, const View& view,
                                         const PictureOptions& options) {
  std::vector<std::vector<RenderMesh>> subjects;
  subjects.reserve(meshes.size());
  for (const Mesh& mesh : meshes) {
    subjects.push_back({{mesh, clay_look()}});
  }
  return pictures_at_one_scale(std::move(subjects), view, options);
}

}  // namespace atelier
