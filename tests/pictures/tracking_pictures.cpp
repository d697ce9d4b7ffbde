// Shows tracked frames on the truth: tracking_pictures CAPTURE WORKSPACE SEQUENCE PICTURE.png. One
// row a frame: tracked body (warm) and true body (blue) in one another, from the front and the
// side; then the tracked body with the distance to the true surface as colour, dark 0 to bright 20
// mm.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/skinning.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kBright = 0.02;  // m

Mesh coloured(Mesh mesh, const Eigen::RowVector3f& colour) {
  mesh.colors = Colors(mesh.vertices.rows(), 3);
  mesh.colors.rowwise() = colour;
  return mesh;
}

void make(const std::filesystem::path& capture, const std::filesystem::path& workspace,
          const std::string& sequence, const std::filesystem::path& out) {
  const PersonalBody person =
      read_personal_body(workspace / "personalize" / "current" / "person.npz");
  const TrackedMotion tracked =
      read_tracked_motion(workspace / "track" / "current" / "tracked" / (sequence + ".h5"));
  const GroundTruth truth = read_ground_truth(capture);
  const std::size_t count = tracked.motion.poses.size();
  std::vector<CaptionedImage> pictures;
  for (const std::size_t f : {std::size_t{0}, count / 2, count - 1}) {
    Mesh body;
    body.vertices = skin_vertices(person.model, tracked.motion.poses[f]);
    body.faces = person.model.mesh.faces;
    Mesh real;
    real.vertices = read_ground_truth_frame(capture, truth, tracked.motion.frame_ids[f]).body;
    real.faces = truth.body.faces;
    Mesh far = body;
    far.colors = Colors(body.vertices.rows(), 3);
    const auto nearest = closest_points(build_tree(real.vertices, real.faces), body.vertices);
    double sum = 0;
    for (Index v = 0; v < body.vertices.rows(); ++v) {
      const double distance = std::sqrt(nearest[static_cast<std::size_t>(v)].squared_distance);
      const auto share = static_cast<float>(std::min(1.0, distance / kBright));
      far.colors.row(v) << share, 0.1F + 0.4F * share, 0.3F * (1 - share);
      sum += distance / static_cast<double>(body.vertices.rows());
    }
    const PictureOptions options{.width = 360, .height = 540, .samples = 6, .framing = {}};
    const Mesh warm = coloured(body, {0.9F, 0.35F, 0.1F});
    const Mesh blue = coloured(real, {0.1F, 0.3F, 0.9F});
    for (const View& view : {kFront, kSide}) {
      const std::vector<RenderMesh> both = {{warm, clay_look()}, {blue, clay_look()}};
      pictures.push_back(CaptionedImage{picture_of(both, view, options),
                                        "frame " + std::to_string(tracked.motion.frame_ids[f])});
    }
    char caption[40];
    std::snprintf(caption, sizeof caption, "%.1f mm mean", 1e3 * sum);
    pictures.push_back(CaptionedImage{picture_of(far, kFront, options), caption});
  }
  write_image(out, contact_sheet(pictures, {.columns = 3}));
}

}  // namespace
}  // namespace atelier

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fputs("tracking_pictures CAPTURE WORKSPACE SEQUENCE PICTURE.png\n", stderr);
    return 2;
  }
  atelier::make(argv[1], argv[2], argv[3], argv[4]);
  return 0;
}
